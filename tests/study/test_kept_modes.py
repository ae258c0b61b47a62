"""A rig whose bodies have fewer modes than its case asks for says so, in one sentence for each number that it asks."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from geometry.errors import ComputationFailed
from study import cli
from study.kind.rig.model import BODIES
from study.reduce.report import report_fewer_rig_modes

SWEEP = """\
[sweep]
from = "240 Hz"
to = "241 Hz"
levels = [1]
[harmonics]
highest = 1
samples = 32
"""


@dataclass(frozen=True)
class Body:
    """All of a reduced model that is looked at."""

    fixed_interface_frequency: np.ndarray


@dataclass(frozen=True)
class Assembly:
    bodies: dict[str, Body]


@dataclass(frozen=True)
class Reduction:
    assembly: Assembly


#: Five bodies with eight modes each.
REDUCTION = Reduction(Assembly({body: Body(np.arange(1.0, 9.0)) for body in BODIES}))


def test_only_numbers_that_are_not_reached_are_told() -> None:
    of = REDUCTION.assembly
    assert report_fewer_rig_modes(of, 40) == []  # type: ignore[arg-type]
    (said,) = report_fewer_rig_modes(of, 41)  # type: ignore[arg-type]
    assert said == "all 40 fixed-interface modes of the bodies are kept: there are no more, although modes = 41"
    asked = {**dict.fromkeys(BODIES, 8), "blade": 9, "damper_right": 7}
    (said,) = report_fewer_rig_modes(of, asked)  # type: ignore[arg-type]
    assert said == "all 8 fixed-interface modes of blade are kept: there are no more, although blade = 9"


@pytest.mark.parametrize("command", ["solve", "limits"])
@pytest.mark.parametrize(("asked", "times"), [(40, 0), (41, 1)])
def test_curves_and_limits_tell_it_before_they_begin(
    at_home: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    short_rig: str,
    command: str,
    asked: int,
    times: int,
) -> None:
    def stop(*_: object) -> None:
        raise ComputationFailed("stopped here")

    monkeypatch.setattr("study.kind.rig.structure.reduce_rig", lambda *_: REDUCTION)
    monkeypatch.setattr("study.kind.rig.structure.make_preloaded_rig", stop)
    (at_home / "rig.toml").write_text(short_rig.replace("modes = 40", f"modes = {asked}") + SWEEP, encoding="utf-8")
    assert cli.main([command, "rig.toml", "--out", "out"]) == 1
    said = capsys.readouterr().err
    assert "stopped here" in said
    assert said.count("stickslip: all 40 fixed-interface modes of the bodies are kept: there are no more") == times
