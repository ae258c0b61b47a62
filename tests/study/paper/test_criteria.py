"""The criteria of figure 16 as numbers, on bands and readings that are made by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from casefile.table import load_case
from correlation.family.band import PredictedBand
from correlation.family.family import Family, FamilyCurve
from correlation.family.noise import ReadingNoise
from correlation.family.verdict import FamilyVerdict, judge_family
from pipeline.store import Stage, Store
from study.paper.case import CriteriaTable, PaperCase
from study.paper.criteria import DYNAMIC, STATIC_NORMAL, STATIC_TANGENTIAL, judge_forces, judge_response
from study.paper.limits import IterationLimits
from study.shipped_cases import PAPER

FREQUENCY = np.linspace(250.0, 254.0, 5)


def criteria() -> CriteriaTable:
    return load_case(PAPER, PaperCase).criteria


def verdict(
    sensor: str, harmonic: int, readings: list[float], limits: tuple[float, float], noise: float | None = None
) -> FamilyVerdict:
    """Readings of two curves at five frequencies over a band that is the same at all of them."""
    curves = tuple(
        FamilyCurve(test="t", repeat=repeat, sweep=1, frequency=FREQUENCY, value=np.full(5, value))
        for repeat, value in enumerate(readings, start=1)
    )
    value = np.repeat(np.array(limits)[:, None], 5, axis=1)
    band = PredictedBand(
        frequency=FREQUENCY, value=value, deviation=np.zeros((2, 5)), jump=np.zeros((2, 5), dtype=bool)
    )
    stated = ReadingNoise(absolute=1e-6 * abs(readings[0]) if noise is None else noise, source="stated")
    return judge_family(
        Family(sensor=sensor, harmonic=harmonic, level=5.0, curves=curves), band, stated, shift=0.0, n_reading=10
    )


@pytest.mark.parametrize(("reading", "met"), [(1.5, True), (2.5, False)])
def test_the_response_is_met_where_the_band_holds_its_readings(reading: float, met: bool) -> None:
    limits = IterationLimits(response=(verdict("tip", 1, [1.2, reading], (1.0, 2.0)),), forces=())
    criterion = judge_response(limits, criteria())
    assert criterion.met is met
    # One of two curves lies inside.
    assert criterion.scores[0].value == pytest.approx(1.0 if met else 0.5)


def test_limits_of_an_iteration_are_stored_whole(tmp_path: Path) -> None:
    limits = IterationLimits(response=(verdict("tip", 1, [1.2, 2.5], (1.0, 2.0)),), forces=())
    kept = Stage(name="limits", compute=lambda: limits, ignore=frozenset())
    store = Store(tmp_path)
    store.run(kept)
    again = store.outcome(replace(kept, compute=lambda: None))
    assert again.cached
    assert judge_response(again.value, criteria()) == judge_response(limits, criteria())


@pytest.mark.parametrize(("middle", "met"), [(21.4, True), (25.5, False)])
def test_a_static_normal_force_is_the_middle_of_its_limits_over_the_mean_of_the_readings(
    middle: float, met: bool
) -> None:
    # The paper's numbers for the left damper: 25.5 N predicted, 21 N measured.
    forces = (
        verdict("left_decoupler_T", 0, [2.0, 3.0], (1.0, 4.0)),
        verdict("left_decoupler_N", 0, [20.5, 21.5], (middle - 2, middle + 2)),
    )
    criterion = judge_forces(IterationLimits(response=(), forces=forces), criteria())
    score = next(item for item in criterion.scores if item.name == STATIC_NORMAL)
    assert score.value == pytest.approx(abs(middle / 21 - 1), rel=1e-9)
    assert score.met is met


def test_forces_outside_of_their_limits_are_measured_by_their_own_scale() -> None:
    forces = (
        verdict("left_decoupler_T", 0, [2.0, 5.0], (1.0, 4.0)),
        verdict("left_decoupler_N", 0, [20.0, 20.0], (19.0, 21.0)),
        verdict("left_decoupler_T", 1, [8.0, 10.0], (1.0, 9.0)),
    )
    scores = {item.name: item for item in judge_forces(IterationLimits(response=(), forces=forces), criteria()).scores}
    assert scores[STATIC_TANGENTIAL].value == pytest.approx(1 / 20, rel=1e-9)
    assert scores[DYNAMIC].value == pytest.approx(1 / 10, rel=1e-9)


@pytest.mark.parametrize(("noise", "value"), [(0.01, 0.05 / 0.15), (0.02, 0.0)])
def test_the_noise_floor_of_a_small_force_is_not_outside(noise: float, value: float) -> None:
    # 0.05 N beyond the limit: five standard deviations of the noise, or two and a half.
    forces = (verdict("left_decoupler_T", 1, [0.08, 0.15], (0.05, 0.10), noise),)
    (score,) = judge_forces(IterationLimits(response=(), forces=forces), criteria()).scores
    assert score.value == pytest.approx(value, rel=1e-9)


def test_a_limit_that_was_not_found_meets_no_criterion() -> None:
    forces = (
        verdict("left_decoupler_T", 0, [2.0, 3.0], (1.0, 4.0)),
        verdict("left_decoupler_N", 0, [20.0, 20.0], (np.nan, np.nan)),
    )
    criterion = judge_forces(IterationLimits(response=(), forces=forces), criteria())
    assert criterion.met is False


def test_without_limits_nothing_is_judged() -> None:
    assert judge_forces(IterationLimits(response=(), forces=()), criteria()).met is None
