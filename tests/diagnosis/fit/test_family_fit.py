"""Calibration onto families finds the parameters of the structure whose friction histories were measured."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from correlation.family.family import Family, FamilyCurve
from correlation.family.noise import ReadingNoise, RepeatErrors
from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from diagnosis.candidate.effect import EffectError, EffectParameter
from diagnosis.fit.calibration_parameter import CalibratedEffect, CalibrationParameter, list_calibration_parameters
from diagnosis.fit.family_fit import FamilyTarget, fit_families, sampled_bands
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
    return FamilyTarget(
        families=measured(), errors=RepeatErrors(noise=noise, frequency=0.0), frequency=FREQUENCY, shift=1e-5
    )


def test_the_true_parameters_score_better_than_others() -> None:
    true = np.array([TRUE[item.name] for item in calibration_parameters()])
    best = target().score(compose(true))
    for number in range(2):
        for factor in (0.93, 1.07):
            other = true.copy()
            other[number] *= factor
            assert target().score(compose(other)) > best


def test_the_fit_finds_what_was_measured() -> None:
    fit = fit_families(compose, calibration_parameters(), np.ones(2), target(), most=40)
    assert fit.after < 0.2 * fit.before
    assert fit.n_evaluation <= 40
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
class Measuring:
    """Measurements that say 2 mm with a standard deviation of 1 mm."""

    count: int = 1

    def score(self, length: Any) -> float:
        return 0.5 * ((float(length[0]) - 2e-3) / 1e-3) ** 2


def test_a_prior_is_about_the_value_that_changes_nothing() -> None:
    length: Any = CalibratedEffect.from_effect(Length(), 1e-3)
    found: Any = lambda values: values  # noqa: E731 - the values are the model
    measuring: Any = Measuring()
    fit = fit_families(found, [length], np.zeros(1), measuring, most=100)
    assert fit.before == 2.0
    # Half way between two that weigh the same; flat to the simplex's stop, 1e-2 standard deviations or so.
    assert fit.values[0] == pytest.approx(1e-3, abs=1e-4)


@pytest.mark.parametrize("deviation", [0.0, -1.0, np.nan])
def test_an_effect_without_a_prior_is_refused(deviation: float) -> None:
    with pytest.raises(EffectError, match="standard deviation"):
        CalibratedEffect.from_effect(Length(), deviation)


def test_an_effect_of_two_parameters_is_refused() -> None:
    (own,) = Length().parameters
    with pytest.raises(EffectError, match="length, width"):
        CalibratedEffect.from_effect(Length(parameters=(own, replace(own, name="width"))), 1e-3)


def test_sampled_bands_lie_within_each_other_as_histories_grow_fewer() -> None:
    bands = sampled_bands(drawn(), measured(), FREQUENCY)
    assert set(bands) == {("x", 1, level) for level in LEVELS}
    for band in bands.values():
        assert (band.value[0] <= band.value[1]).all()
    for low, high in pairwise(LEVELS):
        assert (bands["x", 1, high].value > bands["x", 1, low].value).any()
