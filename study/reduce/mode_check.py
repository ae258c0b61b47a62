"""What a check of fixed-interface modes found, in words and as a document."""

from typing import Any

import numpy as np

from fe.mode_check import ModeCheck


def check_sentence(check: ModeCheck) -> str:
    """One sentence: residuals, and whether all modes are there."""
    below = f"below {np.sqrt(check.shift) / (2 * np.pi):.6g} Hz"
    counted = f"{check.n_found} fixed-interface modes {below}, residuals of at most {check.residual.max():.0e}"
    if check.n_missed > 0:
        return f"{counted}, but {check.n_below} are there: {check.n_missed} MISSED"
    if check.n_missed < 0:
        return f"{counted}, but only {check.n_below} are there: {-check.n_missed} FOUND TWICE"
    return f"{counted}, none missed"


def check_document(check: ModeCheck) -> dict[str, Any]:
    """The same for programs."""
    return {
        "largest_residual": float(check.residual.max()),
        "counted_below_hz": float(np.sqrt(check.shift) / (2 * np.pi)),
        "n_below": check.n_below,
        "n_found": check.n_found,
    }
