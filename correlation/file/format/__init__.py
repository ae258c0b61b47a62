"""Formats of test files, one per file; `MEASURED_FILES` finds them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from correlation.file.column import MeasuredFile
from geometry.registry import Registry

__all__ = ["HEAD", "MEASURED_FILES", "MeasuredFileFormat"]

#: Number of bytes at the beginning of a file by which its format is recognised.
HEAD = 4096


@dataclass(frozen=True, kw_only=True)
class MeasuredFileFormat:
    """One format of test files.

    Parameters
    ----------
    name
        Name of the format.
    holds
        Description of the file that a user gives, such as "an HDF5 file".
    suffixes
        Endings of its files, lower case (".uff"), which decide if no format or several formats recognise the content.
    recognise
        Function that decides whether the first `HEAD` bytes of a file are those of this format; never fails.
    read
        Reads the content of a file; raises `CampaignError` for a damaged file, one sentence with file, place, value and
        remedy.
    """

    name: str
    holds: str
    suffixes: tuple[str, ...]
    recognise: Callable[[bytes], bool]
    read: Callable[[Path], MeasuredFile]


def _wrong(format_: MeasuredFileFormat) -> str | None:
    if not (isinstance(format_.holds, str) and format_.holds.strip()):
        return f"has holds = {format_.holds!r}: say what a user gives, in words"
    if not format_.suffixes or any(suffix != suffix.lower() or suffix[:1] != "." for suffix in format_.suffixes):
        return f"has the suffixes {format_.suffixes}: give lower-case ones with their dot"
    for fact in ("recognise", "read"):
        if not callable(getattr(format_, fact)):
            return f"has {fact} = {getattr(format_, fact)!r}: give a function"
    return None


MEASURED_FILES: Registry[MeasuredFileFormat] = Registry(
    "measured file format",
    package="correlation.file.format",
    group="stickslip.measured_files",
    facts={
        "holds": "what a user gives, in words",
        "suffixes": "endings of its files, lower case",
        "recognise": "a function of the first bytes of a file that says whether it is one",
        "read": "a function of a path",
    },
    check=_wrong,
)
