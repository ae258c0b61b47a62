"""What is wrong with a file of matrices, told at its key: that shows the file's name, and the message need not."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from casefile.table import at_key, located
from fe.errors import MatrixFileError
from study.case.tables import Case
from study.kind.matrices.table import MatricesTable


@contextmanager
def at_file(case: Case[MatricesTable], files: Mapping[str, Path]) -> Iterator[None]:
    """Give what a reader refuses the key of the file that it speaks of first.

    Parameters
    ----------
    case
        The case.
    files
        By their keys in `[structure.files]`.

    Raises
    ------
    CaseError
        In place of a `MatrixFileError` raised within.
    """
    try:
        yield
    except MatrixFileError as error:
        said = str(error)
        spoken = {key: said.find(f'"{file}"') for key, file in files.items()}
        found = [key for key in files if spoken[key] >= 0]
        if not found:
            with located(case, "structure", "files"):
                raise
        # One file may hold several matrices: the one that is named then.
        first = min(found, key=lambda key: (spoken[key], f"the {key}" not in said))
        with at_key(case, "structure", "files", first):
            raise MatrixFileError(without_name(said, first, files[first])) from error


def without_name(said: str, key: str, file: Path) -> str:
    """A message without the name of the file that it is about."""
    said = said.removeprefix(f"the {key}: ")
    missing = f'there is no file "{file}": check its name and folder'
    if said.startswith(missing):
        return (
            f"there is no such file: check its name and folder, which count from the case{said.removeprefix(missing)}"
        )
    for between in (": ", ", ", " "):
        if said.startswith(f'"{file}"{between}'):
            return said.removeprefix(f'"{file}"{between}')
    return said.replace(f'"{file}"', "this file", 1)
