"""What a case file is meant as, before it is read with care; and the refusal of one that another command is for."""

import tomllib
from pathlib import Path
from typing import Any

from casefile.errors import CaseError, Problem


def case_head(path: Path) -> dict[str, Any]:
    """All that a case file says; nothing of one that cannot be read, for `casefile.table.load_case` tells why."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8").removeprefix("\ufeff"))
    except (OSError, ValueError, RecursionError):
        return {}


def other_case(path: Path, what: str, remedy: str) -> CaseError:
    """The refusal of a whole file.

    Parameters
    ----------
    path
        The case file.
    what
        Of what it is the case, with its article.
    remedy
        What the user should do, in the imperative.
    """
    return CaseError([Problem(file=str(path), line=0, key="", text=f"this is the case of {what}: {remedy}")])
