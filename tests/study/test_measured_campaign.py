"""A campaign whose ring-downs were analysed once is read again with what was found then."""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from correlation.data_type.ring_down import FreeDecay
from correlation.errors import CampaignError
from pipeline.progress import LineProgress
from pipeline.store import Store
from study.measured_campaign import read_measured
from study.run_context import RunContext, silent_run

MANIFEST = """schema = 1

[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"

[[ring_down]]
name = "release"
file = "decay.csv"
configuration = "jointed"
sensor = "tip"

[ring_down.columns]
time = "t"
value = { column = "x", unit = "mm" }
"""


def write_decay(folder: Path, frequency: float) -> None:
    time = np.arange(600) / 600.0
    value = np.exp(-3.0 * time) * np.cos(2 * np.pi * frequency * time)
    rows = "\n".join(f"{t:.6f},{x:.9f}" for t, x in zip(time, value, strict=True))
    (folder / "decay.csv").write_text(f"t,x\n{rows}\n")
    (folder / "campaign.toml").write_text(MANIFEST)


@pytest.fixture
def run(tmp_path: Path) -> RunContext:
    return replace(silent_run(), store=Store(tmp_path / "store"))


def found(folder: Path, run: RunContext) -> FreeDecay:
    (decay,) = read_measured(folder, run).data
    assert isinstance(decay, FreeDecay)
    return decay


def test_a_ring_down_is_analysed_once(tmp_path: Path, run: RunContext, monkeypatch: pytest.MonkeyPatch) -> None:
    write_decay(tmp_path, 50.0)
    first = found(tmp_path, run)

    def again(*_: object) -> None:
        raise AssertionError("the modes were fitted again")

    monkeypatch.setattr("correlation.signal.ring_down.fit_modes", again)
    second = found(tmp_path, run)
    for one, other in zip(first.modes, second.modes, strict=True):
        np.testing.assert_array_equal(one.frequency, other.frequency)
        np.testing.assert_array_equal(one.damping_deviation, other.damping_deviation)
    # Other numbers in the file are another decay.
    write_decay(tmp_path, 60.0)
    with pytest.raises(AssertionError, match="fitted again"):
        found(tmp_path, run)


def test_a_record_without_a_decay_is_refused_each_time(tmp_path: Path, run: RunContext) -> None:
    write_decay(tmp_path, 50.0)
    (tmp_path / "decay.csv").write_text("t,x\n" + "\n".join(f"{k / 600:.6f},0.0" for k in range(600)) + "\n")
    for _ in range(2):
        with pytest.raises(CampaignError, match=r"decay\.csv"):
            read_measured(tmp_path, run)
    assert run.store.size() == (0, 0)


def test_no_duration_is_announced_for_an_analysis_that_was_never_done(tmp_path: Path, run: RunContext) -> None:
    write_decay(tmp_path, 50.0)
    stream = StringIO()
    clock = iter(np.arange(0.0, 1e6, 60.0))  # each look at the clock is a minute later
    found(tmp_path, replace(run, progress=LineProgress(stream, clock=lambda: float(next(clock)))))
    assert "about" not in stream.getvalue()
    assert "campaign: 100 %" in stream.getvalue()
