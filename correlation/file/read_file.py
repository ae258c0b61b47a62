"""Reader of test files: the format is recognised by content, then by suffix; other text is read as a table."""

from dataclasses import replace
from pathlib import Path

from correlation.errors import CampaignError
from correlation.file.abscissa import add_abscissas
from correlation.file.arrays.first_column import pair_first_columns
from correlation.file.arrays.signal_calc import read_signal_units
from correlation.file.column import MeasuredFile
from correlation.file.decibel import read_decibels
from correlation.file.format import HEAD, MEASURED_FILES, MeasuredFileFormat

#: Format of text with an unknown suffix.
TEXT = "csv"


def read_file(path: Path) -> MeasuredFile:
    """Read a test file of any registered format.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    Content of the file: columns in the units of the file, nodes and measured shapes.

    Raises
    ------
    CampaignError
        The file does not exist, has no known format, or is damaged: one sentence with file, place, value and remedy.
    """
    format_ = find_file_format(path)
    try:
        measured = format_.read(path)
    except CampaignError:
        raise
    except MemoryError:
        raise CampaignError(f"{path.name}: needs more memory than there is; split the file, or add memory") from None
    except Exception as error:  # Libraries that parse damaged files fail in many ways.
        place = MEASURED_FILES.entry(format_.name)
        reason = " ".join(str(error).split())[:200] or "no message"
        raise CampaignError(
            f'{path.name}: is damaged, or its reader "{format_.name}" ({Path(place.file).name}) fails with '
            f"{type(error).__name__} ({reason}); export the file again"
        ) from error
    if not (measured.columns or measured.shapes or measured.nodes):
        reasons = "; ".join(f"{name}: {text}" for name, text in measured.facts.items() if text.startswith("not read"))
        raise CampaignError(f"{path.name}: has no numbers ({reasons[:200] or 'no channels'}); give another file")
    measured = add_abscissas(pair_first_columns(read_signal_units(measured)))
    return replace(measured, columns=tuple(read_decibels(column) for column in measured.columns))


def find_file_format(path: Path) -> MeasuredFileFormat:
    """Find the format of a file.

    Raises
    ------
    CampaignError
        The file does not exist, is empty, or has no known format.
    """
    if path.exists() and not path.is_file():
        raise CampaignError(f"{path.name}: is a folder or a device; give one file")
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD)
    except FileNotFoundError:
        raise CampaignError(f'{path.name}: there is no such file in "{path.parent}"; correct its name') from None
    except OSError as error:
        raise CampaignError(f"{path.name}: cannot be read ({error.strerror}); check its permissions") from None
    if not head:
        raise CampaignError(f"{path.name}: is empty; export it again")
    recognised = [format_ for format_ in MEASURED_FILES if format_.recognise(head)]
    by_suffix = [format_ for format_ in MEASURED_FILES if path.name.lower().endswith(format_.suffixes)]
    both = [format_ for format_ in recognised if format_ in by_suffix]
    for candidates in (both, recognised, by_suffix):
        if candidates:
            return candidates[0]
    if not any(byte < 32 and byte not in b"\t\n\r\f" for byte in head) and TEXT in MEASURED_FILES:
        return MEASURED_FILES[TEXT]
    known = ", ".join(format_.holds for format_ in MEASURED_FILES)
    hint = "; it is a spreadsheet or an archive: save its sheets as CSV" if head.startswith(b"PK\x03\x04") else ""
    raise CampaignError(f"{path.name}: is of no known format{hint or f': give {known}'}")
