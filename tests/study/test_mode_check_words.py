"""What a check of modes found is said in so many words, above all if some are missing."""

import numpy as np
import pytest

from fe.mode_check import ModeCheck
from study.reduce.report import describe_check, document_check


@pytest.mark.parametrize(
    ("below", "words"), [(12, "none missed"), (14, "14 exist: 2 MISSED"), (11, "only 11 exist: 1 FOUND TWICE")]
)
def test_missed_modes_are_told(below: int, words: str) -> None:
    check = ModeCheck(residual=np.array([1e-12, 3e-10]), shift=(2 * np.pi * 500) ** 2, n_below=below, n_found=12)
    sentence = describe_check(check)
    assert sentence.startswith("12 fixed-interface modes below 500 Hz, residuals of at most 3e-10, ")
    assert sentence.endswith(words)
    assert document_check(check)["counted_below_hz"] == pytest.approx(500)
