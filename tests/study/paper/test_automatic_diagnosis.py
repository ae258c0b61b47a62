"""What a diagnosis ends with, as parameters of the rig."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.errors import CampaignError
from diagnosis.decision.verdict import Finding
from diagnosis.effect.inclination import Inclination
from diagnosis.effect.shift import Shift
from diagnosis.fit.calibration_parameter import CalibrationParameter
from pipeline.store import Store
from study.paper import automatic_diagnosis
from study.paper.automatic_diagnosis import diagnose_automatically, diagnosing_automatically, read_values
from study.paper.parameters import RigParameters

START = RigParameters(kt=4e6, kn=8e6, mu=0.6, damping=2e-3, shift_left=1e-3)


def calibration_parameter(name: str) -> CalibrationParameter:
    return CalibrationParameter(name=name, physics="", deviation=0.1, parameters=())


def refit(effect: Shift | None, values: list[float], deviation: list[float], beside: Inclination | None = None) -> Any:
    fit = SimpleNamespace(values=np.array(values), deviation=np.array(deviation))
    return SimpleNamespace(effect=effect, beside=beside, fit=fit)


def ended(finding: Finding) -> Any:
    """A round with an effect of an earlier one, and a best effect that counts only if the finding names it."""
    names, earlier = ("kt", "zeta"), Shift(name="shift of right dead weight", weight="right dead weight")
    own = Shift(name="shift of left dead weight", weight="left dead weight")
    best = refit(own, [1.1, 0.9, 2e-4, -3e-3], [0.01, 0.1, 1e-4, 5e-4])
    before = refit(None, [1.2, 0.8, 3e-4], [0.01, 0.1, 1e-4])
    setup = SimpleNamespace(
        calibration_parameters=tuple(map(calibration_parameter, names)), added=(SimpleNamespace(effect=earlier),)
    )
    return SimpleNamespace(
        best=best, setup=setup, diagnosis=SimpleNamespace(verdict=SimpleNamespace(finding=finding, baseline=before))
    )


def test_factors_scale_the_start_and_shifts_are_added_to_it() -> None:
    values, others = read_values(ended(Finding.MISSING), START)
    result = {item.name: item for item in values}
    assert result["kt"].value == pytest.approx(1.1 * START.kt)
    assert result["damping"].value == pytest.approx(0.9 * START.damping)
    assert result["shift_right"].value == pytest.approx(2e-4)
    assert result["shift_left"].value == pytest.approx(1e-3 - 3e-3)
    # 95 % of a normal distribution.
    assert result["shift_left"].upper - result["shift_left"].value == pytest.approx(1.96 * 5e-4, rel=1e-3)
    assert others == ()


def test_a_second_effect_is_part_of_the_answer() -> None:
    result = ended(Finding.AMBIGUOUS)
    second = Inclination(name="inclination of left dead weight", weight="left dead weight")
    values, deviation = [1.1, 0.9, 2e-4, -3e-3, 0.05], [0.01, 0.1, 1e-4, 5e-4, 0.01]
    result.best = refit(result.best.effect, values, deviation, second)
    read = {item.name: item.value for item in read_values(result, START)[0]}
    assert read["inclination_left"] == pytest.approx(0.05)
    assert read["shift_left"] == pytest.approx(1e-3 - 3e-3)


def test_an_effect_that_is_not_named_is_no_part_of_the_answer() -> None:
    result = {item.name: item for item in read_values(ended(Finding.NOTHING), START)[0]}
    assert result["kt"].value == pytest.approx(1.2 * START.kt)
    assert "shift_left" not in result


def test_a_stored_diagnosis_writes_its_files_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Path] = []

    def refuse(case: Path, *_: Any, **__: Any) -> Any:
        calls.append(case)
        raise CampaignError("two repeats are too few")

    monkeypatch.setattr(automatic_diagnosis, "diagnose_file", refuse)
    monkeypatch.setattr(automatic_diagnosis, "write_case", lambda model, _start: f"title = {model!r}")
    campaign: Any = SimpleNamespace(content={"level": np.ones(2)})
    store, told = Store(tmp_path / "cache"), []
    results = []
    for name in ("one", "other", "one"):
        run: Any = SimpleNamespace(
            output=tmp_path / name, store=store, progress=SimpleNamespace(stored=lambda step: told.append(step))
        )
        run.output.mkdir(exist_ok=True)
        model: Any = "rig"
        results.append(diagnose_automatically(model, START, campaign, tmp_path, run))
        # What is stored needs no process.
        with diagnosing_automatically(model, START, campaign, tmp_path, run) as wait_for_result:
            results.append(wait_for_result())
        assert (run.output / "automatic" / "iteration_1.toml").read_text(encoding="utf-8") == "title = 'rig'"
    assert calls == [tmp_path / "one" / "automatic" / "iteration_1.toml"]
    assert told == ["automatic diagnosis"] * 5
    assert {item.rounds[0].sentence for item in results} == {"no diagnosis: two repeats are too few"}
