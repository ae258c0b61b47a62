"""Times and frequencies of arrays that a file says by a sampling rate, or by a first value and a step."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from correlation.file.read_file import read_file

RATE = 4000.0
DECAY = np.exp(-np.arange(400) / 100.0) * np.cos(np.arange(400) / 3.0)


@pytest.mark.parametrize(
    "values",
    [
        {"fs": RATE, "acc": DECAY}, {"Fs_kHz": RATE / 1e3, "acc": DECAY}, {"dt": 1 / RATE, "acc": DECAY},
        {"data": {"sampling_rate": RATE, "acc": DECAY}}, {"fs": RATE, "data": {"acc": DECAY, "force": DECAY}},
        {"fs": RATE, "dt": 1 / RATE, "acc": DECAY}, {"sampling_interval_ms": 1e3 / RATE, "acc": DECAY},
    ],
)  # fmt: skip
def test_a_rate_beside_or_above_arrays_gives_their_time(tmp_path: Path, values: dict[str, Any]) -> None:
    savemat(tmp_path / "a.mat", values)
    (time,) = [one for one in read_file(tmp_path / "a.mat").columns if one.function == "time"]
    np.testing.assert_allclose(time.values, np.arange(400) / RATE, rtol=1e-12)
    assert time.unit == "s"


@pytest.mark.parametrize(
    ("above", "header", "has_time"),
    [
        ("# Sample rate: 4000 Hz", "acc [m/s^2]", True), ("Sampling rate (kHz);4", "acc [m/s^2]", True),
        ("# dt = 0.25 ms", "acc. tip", True), ("# Sample rate: 4000 Sa", "acc", False),
        ("# Sample rate: 4000 Hz", "phase [deg]", False), ("# Sample rate: 4000 Hz", "f [Hz]", False),
    ],
)  # fmt: skip
def test_a_rate_above_a_table_of_text_gives_its_time(tmp_path: Path, above: str, header: str, has_time: bool) -> None:
    rows = "\n".join(f"{value:.9g}" for value in DECAY)
    (tmp_path / "a.csv").write_text(f"{above}\n{header}\n{rows}\n")
    times = [one for one in read_file(tmp_path / "a.csv").columns if one.function == "time"]
    assert [one.values[1] for one in times] == ([1 / RATE] if has_time else [])


@pytest.mark.parametrize("where", ["dataset", "file"])
def test_a_rate_may_be_an_attribute(tmp_path: Path, where: str) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["acc"] = np.stack([DECAY, DECAY])
        (file["acc"] if where == "dataset" else file).attrs["fs_Hz"] = RATE
    (time,) = [one for one in read_file(tmp_path / "a.h5").columns if one.function == "time"]
    assert time.values[1] == 1 / RATE


@pytest.mark.parametrize(
    "values",
    [
        {"fs": RATE, "t": np.arange(400) / RATE, "acc": DECAY}, {"fs": RATE, "dt": 0.1, "acc": DECAY},
        {"fs": RATE, "H": DECAY + 1j * DECAY}, {"gain": RATE, "acc": DECAY}, {"fs": RATE, "acc": DECAY[:5]},
        {"fs": np.nan, "acc": DECAY}, {"fs": np.inf, "acc": DECAY}, {"dt": 1e-300, "acc": DECAY},
    ],
)  # fmt: skip
def test_no_time_is_made_beside_one_of_contradictions_or_of_complex_numbers(
    tmp_path: Path, values: dict[str, Any]
) -> None:
    savemat(tmp_path / "a.mat", values)
    assert not any(one.function == "time" for one in read_file(tmp_path / "a.mat").columns)


@pytest.mark.parametrize(("unit", "kind"), [("Hz", "frequency"), ("s", "time")])
def test_first_value_and_step_of_a_signal_give_its_abscissa(tmp_path: Path, unit: str, kind: str) -> None:
    values = {
        "x_values": {"start_value": 2.0, "increment": 0.5, "number_of_values": 400.0, "quantity": {"label": unit}},
        "y_values": {"values": DECAY[:, None], "quantity": {"label": "m/s^2"}},
    }
    savemat(tmp_path / "a.mat", {"Signal": values})
    columns = {one.function or one.name: one for one in read_file(tmp_path / "a.mat").columns}
    np.testing.assert_array_equal(columns[kind].values, 2 + 0.5 * np.arange(400))
    assert (columns[kind].unit, columns["Signal.y_values.values"].unit) == (unit, "m/s^2")
