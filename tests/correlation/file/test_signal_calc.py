"""Units of the arrays of SignalCalc, in a list of texts beside them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from correlation.file.read_file import read_file
from study.campaign.find_tables import find_tables
from study.campaign.table_kind import Kind, judge_table

LINES = np.arange(200) * 0.5
VALUES = np.exp(1j * LINES / 30) / (1 + (LINES - 40) ** 2)


@pytest.mark.parametrize("ratio", ["g / N", "(g)(N)"])
def test_arrays_have_the_units_that_the_list_says(tmp_path: Path, ratio: str) -> None:
    info = [
        "Signal X1",
        "Real EU N",
        "0-Z:0-Z",
        "Signal W1",
        "Real EU N",
        "Signal S2",
        "Real/Imag g",
        "Signal G1_2",
        "Real/Imag (g)(N)",
    ]
    info += ["Signal H1_2", f"Real/Imag {ratio}"]
    arrays = {name: np.stack([LINES, size * VALUES], axis=1) for name, size in (("S2", 1), ("G1_2", 2), ("H1_2", 3))}
    texts = np.array([text.ljust(20, "\0") for text in info])
    block = np.stack([LINES, VALUES.real], axis=1)
    savemat(tmp_path / "a.mat", {"DP_Info": texts, "X1": block, "W1": 0.9 * block, **arrays})
    file = read_file(tmp_path / "a.mat")
    assert not any(column.name.startswith("W1") for column in file.columns)  # X1 under a window
    units = {column.name: column.unit for column in file.columns if column.name.endswith("(:,2)")}
    assert (units["X1(:,2)"], units["S2(:,2)"], units["H1_2(:,2)"]) == ("N", "g_n", "g_n/N")
    (responses,) = [
        result for table in find_tables(file)[0] if (result := judge_table(table)).kind is Kind.FREQUENCY_RESPONSE
    ]
    used = [name for name, guess in responses.columns.items() if guess.role.value == "response"]
    assert used == ["H1_2(:,2)"]  # neither the spectrum nor the cross spectrum
