"""Calibration onto families finds the parameters of the structure whose friction histories were measured."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy.optimize
from scipy.special import ndtri

from correlation.family.band import PredictedBand
from correlation.family.family import Family, FamilyCurve
from correlation.family.noise import ReadingNoise, RepeatErrors
from correlation.family.verdict import FamilyVerdict
from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from diagnosis.candidate.effect import EffectError, EffectParameter
from diagnosis.fit.calibration_parameter import CalibratedEffect, CalibrationParameter, list_calibration_parameters
from diagnosis.fit.family_fit import (
    LEAST_FALL,
    ComputeLimits,
    LinearLimits,
    fit_families,
    fit_limits,
)
from diagnosis.fit.family_target import (
    FamilyGroup,
    FamilyLimits,
    FamilyTarget,
    list_numerical_errors,
    sample_bands,
)
from geometry.errors import InputError
from reduction.jointed_system import FrictionContact, JointedSystem

FREQUENCY = np.linspace(17.5, 21.5, 9)
LEVELS = (2.0, 6.0)
TRUE = {"kt": 1.2, "mu": 0.85}
NOISE = 2e-3
#: Motion along the friction of two contacts, and across.
MASS, STIFFNESS = np.diag([1.0, 1.0]), np.array([[1.0e4, 2.0e3], [2.0e3, 4.0e4]])


@cache
def drawn() -> Model:
    contacts = [
        FrictionContact(
            name=f"pad {number}", normal=np.array([0.0, 1.0]), tangents=np.array([[1.0, 0.0]]), normal_stiffness=1e4,
            tangential_stiffness=kt, friction_coefficient=0.5, preload=load,
        )
        for number, (kt, load) in enumerate([(3e3, 4.0), (2e3, 9.0)])
    ]  # fmt: skip
    static = np.sum([item.preload * item.normal for item in contacts], axis=0)
    system = JointedSystem(
        mass=MASS, damping=1e-4 * STIFFNESS + 0.5 * MASS, stiffness=STIFFNESS, joints=contacts, static_load=static,
        harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]),
    )  # fmt: skip
    sensors = (Sensor(name="x", row=np.array([1.0, 0.0])),)
    return Model(system=system, sensors=sensors, lines={"pad": ("pad 0", "pad 1")}, n_harmonic=4, n_sample=64)


def calibration_parameters() -> list[CalibrationParameter]:
    return [item for item in list_calibration_parameters(drawn()) if item.name in TRUE]


def compose(values: np.ndarray) -> Model:
    model = drawn()
    for item, value in zip(calibration_parameters(), values, strict=True):
        model = item.apply(model, [float(value)])
    return model


def measured() -> list[Family]:
    """Six histories of the true structure with noise."""
    model = compose(np.array([TRUE[item.name] for item in calibration_parameters()]))
    random = np.random.default_rng(4)
    n = len(FREQUENCY)
    families = []
    for level in LEVELS:
        points = Points(
            free=np.zeros(n, dtype=bool), level=np.full(n, level), frequency=FREQUENCY, sensor=np.array(["x"] * n),
            harmonic=np.ones(n, dtype=int),
        )  # fmt: skip
        curves = []
        for repeat in range(1, 7):
            start = random.uniform(-0.9, 0.9, 2) * [0.5 * 4 / 3e3, 0.5 * 9 / 2e3]
            value = np.abs(Predictor(points=points, slider=lambda _, w=start: w, sweeps=(1,)).predict(model).value)
            value = value * (1 + NOISE * random.standard_normal(n))
            curves.append(FamilyCurve(test="t", repeat=repeat, sweep=1, frequency=FREQUENCY, value=value))
        families.append(Family(sensor="x", harmonic=1, level=level, curves=tuple(curves)))
    return families


@cache
def target() -> FamilyTarget:
    noise = {("x", 1): ReadingNoise(relative=NOISE, source="stated")}
    errors = RepeatErrors(noise=noise, frequency=0.0)
    return FamilyTarget(groups=[FamilyGroup(measured(), FREQUENCY)], errors=errors, shift=1e-5)


def score(values: np.ndarray) -> float:
    return target().score(target().compute_limits(compose(values)))


def test_the_true_parameters_score_better_than_others() -> None:
    true = np.array([TRUE[item.name] for item in calibration_parameters()])
    best = score(true)
    for number in range(2):
        for factor in (0.93, 1.07):
            other = true.copy()
            other[number] *= factor
            assert score(other) > best


def test_the_fit_finds_what_was_measured() -> None:
    fit = fit_families(compose, calibration_parameters(), np.ones(2), target(), most=40)
    assert fit.after < 0.2 * fit.before
    # An iteration that has begun is finished: three models more.
    assert fit.n_evaluation <= 43
    for item, value in zip(calibration_parameters(), fit.values.tolist(), strict=True):
        # The stiffness is that of the resonance; the friction only of the states that slip.
        assert value == pytest.approx(TRUE[item.name], rel={"kt": 0.02, "mu": 0.05}[item.name])


@dataclass(frozen=True)
class Length:
    """An effect of a length, which is zero in the model as it is."""

    name: str = "length"
    kind: str = "length"
    physics: str = "A length."
    signature: str = "None."
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="length", unit="m", lower=-1.0, upper=1.0, typical=0.1),
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        (length,) = values
        return model.with_system(static_load=length * model.system.static)


@dataclass(frozen=True)
class Measuring(FamilyTarget):
    """Measurements that say 2 mm with a standard deviation of 1 mm."""

    def compute_limits(self, model: Any) -> FamilyLimits:
        return FamilyLimits(np.full((2, 1), float(model[0])), np.ones((2, 1)))

    def score(self, limits: FamilyLimits) -> float:
        return 0.5 * ((float(limits.value[0, 0]) - 2e-3) / 1e-3) ** 2


MEAN = Family(
    sensor="x", harmonic=0, level=1.0,
    curves=(FamilyCurve(test="t", repeat=1, sweep=1, frequency=np.ones(1), value=np.ones(1)),),
)  # fmt: skip
MEASURING = Measuring(groups=[FamilyGroup([MEAN], np.ones(1))], errors=RepeatErrors(noise={}, frequency=0.0), shift=0.0)


def test_a_prior_is_about_the_value_that_changes_nothing() -> None:
    length: Any = CalibratedEffect.from_effect(Length(), 1e-3)
    result: Any = lambda values: values  # noqa: E731 - the values are the model
    fit = fit_families(result, [length], np.zeros(1), MEASURING, most=100)
    assert fit.before == 2.0
    # Half way between two that weigh the same; the least of linear limits is told to a hundredth of the trust region.
    assert fit.values[0] == pytest.approx(1e-3, abs=2e-5)


def test_linear_limits_are_exact_where_limits_are_linear_and_amplitudes_exponential() -> None:
    random = np.random.default_rng(1)
    families = [replace(MEAN, harmonic=harmonic) for harmonic in (0, 1)]
    target = replace(MEASURING, groups=[FamilyGroup(families, np.ones(1))])
    slope, at = random.standard_normal((3, 2)), random.standard_normal(3)

    def limits(scaled: np.ndarray) -> FamilyLimits:
        line = scaled @ slope + np.array([3.0, 0.1])
        value = np.array([line[0], np.exp(line[1])])
        return FamilyLimits(np.array([value, value]), np.full((2, 2), 0.1))

    linear = LinearLimits.differentiate(target, partial(map, limits), at, limits(at), 0.1)
    moved = at + random.standard_normal(3)
    assert linear.score(moved) == pytest.approx(target.score(limits(moved)), rel=1e-10)


def test_central_differences_cancel_what_is_curved() -> None:
    target = band_target(np.full(4, 5.0))

    def limits(scaled: np.ndarray) -> FamilyLimits:
        middle = 5.0 + 2.0 * scaled[0] + 3.0 * scaled[0] ** 2
        return flat(middle - 1.0, middle + 1.0)

    at = np.array([0.5])
    slopes = LinearLimits.differentiate(target, partial(map, limits), at, limits(at), 0.1).slopes
    assert slopes[0, 0, 0, 0] == pytest.approx(2.0 + 6.0 * 0.5, rel=1e-12)
    # At a bound the difference to the other side counts alone, with what it leaves.
    above = scipy.optimize.Bounds(at, np.array([2.0]))
    slopes = LinearLimits.differentiate(target, partial(map, limits), at, limits(at), 0.1, above).slopes
    assert slopes[0, 0, 0, 0] == pytest.approx(2.0 + 6.0 * 0.5 + 3.0 * 0.1, rel=1e-12)


def test_a_limit_that_is_lost_on_one_side_has_the_slope_of_the_other() -> None:
    target = band_target(np.full(4, 5.0))

    def limits(scaled: np.ndarray) -> FamilyLimits:
        lost = flat(5.0 + scaled[0], 6.0 + scaled[0])
        return FamilyLimits(np.where(scaled[0] > 0.0, np.nan, lost.value), lost.deviation)

    at = np.zeros(1)
    slopes = LinearLimits.differentiate(target, partial(map, limits), at, limits(at), 0.1).slopes
    np.testing.assert_allclose(slopes[0, 0], 1.0, rtol=1e-12)


def test_numerical_error_widens_the_limits_of_its_own_family() -> None:
    families = measured()
    band = PredictedBand(
        frequency=FREQUENCY[[0, -1]], value=np.ones((2, 2)), deviation=np.array([[0.0, 2.0], [1.0, 3.0]]),
        jump=np.zeros((2, 2), dtype=bool),
    )  # fmt: skip
    nothing: Any = None
    verdict = FamilyVerdict(
        family=families[1], band=band, limit=nothing, deviation=nothing, coverage=1.0, tightness=1.0, score=1.0,
        departures=(), critical_deviation=3.0, outside=nothing, critical_count=1,
    )  # fmt: skip
    numerical = list_numerical_errors(families, [verdict])
    count = families[0].n_point
    assert (numerical[:, :count] == 0.0).all()
    along = np.tile(np.linspace(0.0, 2.0, len(FREQUENCY)), 6)
    np.testing.assert_allclose(numerical[:, count:], [along, along + 1.0], atol=1e-12)
    plain = target().compute_limits(drawn())
    wide = replace(target(), numerical=numerical).compute_limits(drawn())
    np.testing.assert_array_equal(wide.value, plain.value)
    # All readings share the error: it widens a band as that of one reading does, where noise has as many draws as there
    # are readings.
    shared = numerical * ndtri(1 - 1 / 4) / ndtri(1 - 1 / (2 * (count + 1)))
    np.testing.assert_allclose(wide.deviation**2, plain.deviation**2 + shared**2, rtol=1e-10)


def band_target(value: np.ndarray, repeats: int = 3) -> FamilyTarget:
    """Means of one family at four frequencies, the same in all repeats, without noise."""
    frequency = np.arange(1.0, 5.0)
    curves = [FamilyCurve(test="t", repeat=n, sweep=1, frequency=frequency, value=value) for n in range(repeats)]
    family = Family(sensor="x", harmonic=0, level=1.0, curves=tuple(curves))
    errors = RepeatErrors(noise={("x", 0): ReadingNoise()}, frequency=0.0)
    return FamilyTarget(groups=[FamilyGroup([family], frequency)], errors=errors, shift=0.0)


def flat(low: float, high: float, n: int = 12) -> FamilyLimits:
    return FamilyLimits(np.array([np.full(n, low), np.full(n, high)]), np.zeros((2, n)))


def test_readings_inside_tell_a_factor_of_the_width_by_two_powers() -> None:
    target = band_target(np.full(4, 5.0))
    assert target.score(flat(0.0, 20.0)) - target.score(flat(0.0, 10.0)) == pytest.approx(2 * np.log(2), rel=1e-12)


def test_a_reading_outside_counts_in_each_set_up() -> None:
    targets = {n: band_target(np.full(4, 12.0), n) for n in (3, 6)}
    # Both bands are as wide, and hold the readings or not.
    outside = [of.score(flat(0.0, 10.0, 4 * n)) - of.score(flat(5.0, 15.0, 4 * n)) for n, of in targets.items()]
    # Mean distance 2 over a width of 10, by 2 / alpha with alpha = 1 / (readings + 1).
    assert outside[0] == pytest.approx(3 * np.log1p(26 * 2 / 10), rel=1e-12)
    assert outside[1] == pytest.approx(6 * np.log1p(50 * 2 / 10), rel=1e-12)


@pytest.mark.parametrize(("spread", "powers"), [(0.0, 3.0), (4.0, 2.0)], ids=["closed", "filled by history"])
def test_noise_wider_than_what_readings_fill_counts_in_each_set_up(spread: float, powers: float) -> None:
    """A closed band as wide as its noise has the likelihood of its readings; in an open one the noise says nothing."""
    frequency = np.arange(1.0, 5.0)
    curves = [
        FamilyCurve(test="t", repeat=n, sweep=1, frequency=frequency, value=np.full(4, 12.0 + spread * (n - 1)))
        for n in range(3)
    ]
    family = Family(sensor="x", harmonic=0, level=1.0, curves=tuple(curves))
    target = replace(band_target(np.full(4, 12.0)), groups=[FamilyGroup([family], frequency)])
    # Limits and noise twice as wide.
    scores = [
        target.score(FamilyLimits(12.0 + spread * np.outer([-n, n], np.ones(12)), np.full((2, 12), 0.01 * n)))
        for n in (2, 4)
    ]
    assert scores[1] - scores[0] == pytest.approx(powers * np.log(2), rel=1e-12)


def test_a_valley_of_eight_coupled_parameters_is_followed_to_its_end() -> None:
    """Limits that all parameters move, 30 times as much along one direction as along another, and not quite evenly."""
    random = np.random.default_rng(3)
    mixing = np.linalg.qr(random.standard_normal((8, 8)))[0] * np.geomspace(1.0, 30.0, 8)
    goal = random.uniform(-0.5, 0.5, 8)
    frequency = np.arange(1.0, 9.0)
    curve = FamilyCurve(test="t", repeat=1, sweep=1, frequency=frequency, value=mixing @ goal)
    families = [Family(sensor=f"x{n}", harmonic=0, level=1.0, curves=(curve.where([n]),)) for n in range(8)]
    errors = RepeatErrors(noise={(f"x{n}", 0): ReadingNoise() for n in range(8)}, frequency=0.0)
    target = FamilyTarget(groups=[FamilyGroup(families, frequency)], errors=errors, shift=0.0)

    def limits(scaled: np.ndarray) -> FamilyLimits:
        middle = mixing @ (scaled + 0.02 * scaled**2 - 0.02 * goal**2)
        return FamilyLimits(np.array([middle - 1.0, middle + 1.0]), np.full((2, 8), 1e-3))

    fit = fit_limits(limits, target, 100.0, np.zeros(8), most=80)
    value = limits(fit.values).value
    # All eight readings are inside, but for what ends a fit.
    assert (np.abs(value.mean(axis=0) - mixing @ goal) < 1.0 + LEAST_FALL).all()
    assert (np.abs(limits(np.zeros(8)).value.mean(axis=0) - mixing @ goal) > 1.0).any()


def measure_up_to(most: float) -> ComputeLimits:
    """Two millimetres are measured, and there is no model beyond a length in mm."""

    def limits(scaled: np.ndarray) -> FamilyLimits:
        if scaled[0] > most:
            raise InputError("the damper leaves its groove")
        return MEASURING.compute_limits(1e-3 * scaled)

    return limits


def test_a_fit_that_begins_beside_no_model_takes_slopes_to_the_other_side() -> None:
    result = fit_limits(measure_up_to(4.0), MEASURING, 100.0, np.array([3.9]), most=60)
    # Two millimetres, to the fall of the score that ends the fit.
    assert result.values[0] == pytest.approx(2.0, abs=np.sqrt(2 * LEAST_FALL))


def test_difference_quotients_that_run_side_by_side_change_nothing() -> None:
    start, seen = np.array([3.9]), []
    alone = fit_limits(measure_up_to(4.0), MEASURING, 100.0, start, most=60)
    with ThreadPoolExecutor(3) as executor:
        beside = fit_limits(
            measure_up_to(4.0), MEASURING, 100.0, start, most=60, report=lambda done, _: seen.append(done),
            map_over=executor.map,
        )  # fmt: skip
    np.testing.assert_array_equal(beside.values, alone.values)
    assert beside.after == alone.after
    assert seen == list(range(1, alone.n_evaluation + 1))


def test_a_fit_that_begins_at_a_bound_leaves_it() -> None:
    bounds = scipy.optimize.Bounds(np.zeros(1), np.full(1, 4.0))
    result = fit_limits(measure_up_to(9.0), MEASURING, 100.0, np.array([4.0]), most=60, bounds=bounds)
    assert result.values[0] == pytest.approx(2.0, abs=np.sqrt(2 * LEAST_FALL))


def test_a_start_without_a_model_is_refused() -> None:
    with pytest.raises(InputError, match="groove"):
        fit_limits(measure_up_to(1.0), MEASURING, 100.0, np.array([3.0]), most=60)


def test_limits_that_are_lost_are_no_gain() -> None:
    target = band_target(np.full(4, 5.0))
    inside, outside = flat(0.0, 10.0), flat(5.5, 10.0)
    lost = FamilyLimits(np.where(np.arange(12) < 6, np.nan, outside.value), outside.deviation)
    assert target.score(inside) < target.score(outside) < target.score(lost)


@pytest.mark.parametrize("deviation", [0.0, -1.0, np.nan])
def test_an_effect_without_a_prior_is_refused(deviation: float) -> None:
    with pytest.raises(EffectError, match="standard deviation"):
        CalibratedEffect.from_effect(Length(), deviation)


def test_an_effect_of_two_parameters_is_refused() -> None:
    (own,) = Length().parameters
    with pytest.raises(EffectError, match="length, width"):
        CalibratedEffect.from_effect(Length(parameters=(own, replace(own, name="width"))), 1e-3)


def test_sampled_bands_lie_within_each_other_as_histories_grow_fewer() -> None:
    bands = sample_bands(drawn(), measured(), FREQUENCY)
    assert set(bands) == {("x", 1, level) for level in LEVELS}
    for band in bands.values():
        assert (band.value[0] <= band.value[1]).all()
    for low, high in pairwise(LEVELS):
        assert (bands["x", 1, high].value > bands["x", 1, low].value).any()
