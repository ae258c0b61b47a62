"""MatrixMarket files, as SciPy and ANSYS' ``*EXPORT,name,MMF`` write them."""

from collections.abc import Mapping
from pathlib import Path

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, real_matrix
from fe.file.registry import FileFormat


def read_matrix_market(path: Path) -> Mapping[str, FileMatrix]:
    """Read one real matrix, by SciPy.

    Raises
    ------
    MatrixFileError
        A complex matrix, places without values, or a file that is damaged or of another kind.
    """
    from scipy.io import mminfo, mmread

    try:
        field = mminfo(path)[4]
        matrix = mmread(path)
    except (ValueError, OSError, OverflowError, EOFError) as error:
        raise MatrixFileError(f'"{path}" is no MatrixMarket file, or damaged ({error}): write it again') from None
    if field == "pattern":
        raise MatrixFileError(f'"{path}" holds places without values (pattern): write it as real')
    return {"": real_matrix(path, matrix)}


MATRIX_FORMATS.register(
    FileFormat(
        name="matrix_market",
        suffixes=(".mtx", ".mmf"),
        recognise=lambda head: head.startswith(b"%%MatrixMarket"),
        read=read_matrix_market,
        write=None,
    )
)
