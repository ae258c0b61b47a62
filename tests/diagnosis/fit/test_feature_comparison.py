"""Ring-downs, loops and modes in a fit: the parameters that made them come back, with honest intervals."""

import numpy as np
import pytest

from correlation.data_type.mode import MeasuredMode
from correlation.model import Model, Sensor
from diagnosis.fit.calibration import Ending, calibrate
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.feature_comparison import FeatureComparison, JoinedComparison, fit_together
from diagnosis.fit.fit_parameter import Unknowns
from reduction.jointed_system import JointedSystem

MODULUS, DAMPING = 1.012, 1.25


def make_model(modulus: float = 1.0, damping: float = 1.0) -> Model:
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    system = JointedSystem(
        mass=np.eye(2), damping=damping * 1e-4 * stiffness, stiffness=modulus * stiffness, joints=[],
        static_load=np.zeros(2), harmonic_force=np.array([[0, 0], [1.0, 0]]),
    )  # fmt: skip
    sensors = tuple(Sensor(name=name, row=row) for name, row in zip(("a", "b"), np.eye(2), strict=True))
    return Model(system=system, sensors=sensors, n_harmonic=2)


def make_modes(random: np.random.Generator, names: tuple[str, ...] = ("lower", "upper")) -> list[MeasuredMode]:
    """Modes of a stiffer and more damped chain, each number off by its deviation."""
    modes = []
    for name, factor in zip(names, (1.0, np.sqrt(3)), strict=False):
        omega = 200 * factor * np.sqrt(MODULUS)
        frequency, ratio = omega / (2 * np.pi), DAMPING * 1e-4 * (200 * factor) ** 2 / (2 * omega)
        deviations = 5e-4 * frequency, 0.02 * ratio
        noise = random.standard_normal(2) * deviations
        modes.append(
            MeasuredMode(
                name=name,
                configuration="jointed",
                frequency=frequency + noise[0],
                frequency_deviation=deviations[0],
                damping=ratio + noise[1],
                damping_deviation=deviations[1],
            )
        )
    return modes


def make_unknowns() -> Unknowns:
    base = make_model()
    parameters = list_calibration_parameters(base)
    assert [item.name for item in parameters] == ["zeta", "E"]
    return Unknowns.from_effects(base, [(item, item.deviation) for item in parameters], [])


@pytest.mark.parametrize("seed", range(5))
def test_the_parameters_that_made_the_data_come_back(seed: int) -> None:
    unknowns = make_unknowns()
    data = FeatureComparison.from_data(make_modes(np.random.default_rng(seed)))
    fit = calibrate(data, unknowns, unknowns.vanishing, data.predict(unknowns.base), ending=Ending.EXACT)
    # Two numbers with five seeds: four standard deviations fail by chance once in 1600 such tests.
    error = (fit.values - [DAMPING, MODULUS]) / fit.deviation
    assert np.abs(error).max() < 4
    # Two frequencies of 0.05 %, whose squares the modulus is: 0.1 % / sqrt(2); the prior of 1 % adds nothing.
    assert fit.deviation[1] == pytest.approx(1e-3 / np.sqrt(2), rel=0.15)


def test_two_sets_of_data_are_fitted_as_one() -> None:
    unknowns, modes = make_unknowns(), make_modes(np.random.default_rng(7))
    whole = FeatureComparison.from_data(modes)
    halves = JoinedComparison(
        first=FeatureComparison.from_data(modes[:1]), second=FeatureComparison.from_data(modes[1:])
    )
    fit = calibrate(whole, unknowns, unknowns.vanishing, whole.predict(unknowns.base), ending=Ending.EXACT)
    joined = calibrate(halves, unknowns, unknowns.vanishing, halves.predict(unknowns.base), ending=Ending.EXACT)
    assert joined.values == pytest.approx(fit.values, rel=1e-9)
    assert joined.deviation == pytest.approx(fit.deviation, rel=1e-6)


def test_a_number_without_a_prediction_fits_badly() -> None:
    (mode, _) = make_modes(np.random.default_rng(0))
    far = MeasuredMode(**{**vars(mode), "frequency": 500.0})
    data = FeatureComparison.from_data([far])
    prediction = data.predict(make_model())
    assert not data.has_prediction(prediction).any()
    assert (data.residual(prediction) == 10.0).all()


def test_a_fit_goes_on_with_more_data() -> None:
    unknowns, modes = make_unknowns(), make_modes(np.random.default_rng(7))
    first, whole = FeatureComparison.from_data(modes[:1]), FeatureComparison.from_data(modes)
    alone = calibrate(first, unknowns, unknowns.vanishing, first.predict(unknowns.base), ending=Ending.EXACT)
    assert fit_together(first, alone, []) is alone
    together = fit_together(first, alone, modes[1:])
    expected = calibrate(whole, unknowns, unknowns.vanishing, whole.predict(unknowns.base), ending=Ending.EXACT)
    # Both stop where a step gains less than 0.3 of chi^2, a third of a standard deviation at most.
    assert np.abs((together.values - expected.values) / expected.deviation).max() < 0.3
    assert (together.deviation < alone.deviation).all()
    assert len(together.prediction) == len(first.measured)
