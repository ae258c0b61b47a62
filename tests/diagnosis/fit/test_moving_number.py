"""A number that moves contacts is calibrated like any other: its slope is that of predictions, its value comes back."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.prediction import Prediction
from diagnosis.fit import calibration_parameter as accepted_parameters
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.fit.contact_position import with_contact_position
from diagnosis.fit.reading_slopes import STEP
from diagnosis.fit.tangent import differentiate
from reduction.jointed_system import FrictionContact, along

BEARING, KT = 0.9, 1.04
EXACT_MODEL = Budget(frequency=0.0, compliance=0.0, shares=0.0)


@pytest.fixture(scope="module")
def long(small: Model) -> Model:
    """Lines of three contacts that reach over both masses."""
    joints, lines = [], {}
    for name, side in (("left", 1.0), ("right", -1.0)):
        for number, (share, where) in enumerate(zip((0.2, 0.5, 0.3), (0.0, 0.5, 1.0), strict=True)):
            z, x = along(4, {0: 1 - where, 2: where}), along(4, {1: 1 - where, 3: where})
            joints.append(
                FrictionContact(
                    name=f"{name} {number}", normal=side * (0.3 * z + 0.8 * x), tangents=0.9 * z,
                    normal_stiffness=2e4 * share, tangential_stiffness=1e4 * share, friction_coefficient=0.4,
                    preload=8.0 * share,
                )
            )  # fmt: skip
        lines[name] = tuple(f"{name} {number}" for number in range(3))
    static = np.sum([joint.preload * joint.normal for joint in joints], axis=0)
    return replace(small, system=replace(small.system, joints=joints, static_load=static), lines=lines)


@pytest.fixture(scope="module")
def arranged(long: Model, paper: ModuleType) -> Arrangement:
    known = list_calibration_parameters(long, deviation={"kn": 0.0, "E": 0.0, "bearing": 0.05})
    (kt,) = (item for item in known if item.name == "kt")
    campaign = paper.make_campaign(with_contact_position(kt.apply(long, [KT]), BEARING), jitter=3e-5, seed=3)
    return arrange(campaign, long, known, EXACT_MODEL)


def test_it_comes_back_within_its_error(arranged: Arrangement) -> None:
    fit = arranged.fit
    assert fit.unknowns.names == ("kt", "mu", "zeta", "bearing")
    # Normal: 4 standard deviations once in 16 000; the errors are small enough for the test to mean something.
    assert fit.values[3] == pytest.approx(BEARING, abs=4 * fit.deviation[3])
    assert fit.values[0] == pytest.approx(KT, abs=4 * fit.deviation[0])
    assert fit.deviation[3] < 0.02
    # chi-square of some 170 numbers, see test_calibration.
    assert fit.chi2 / fit.n_number < 1.5


def test_without_it_the_fit_is_bad(arranged: Arrangement, long: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(with_contact_position(long, BEARING), jitter=3e-5, seed=3)
    fixed = arrange(campaign, long, list_calibration_parameters(long, deviation={"kn": 0.0, "E": 0.0}), EXACT_MODEL)
    assert fixed.fit.chi2 > 3 * arranged.fit.chi2


def test_its_slope_is_the_difference_of_predictions(arranged: Arrangement) -> None:
    fit, unknowns = arranged.fit, arranged.fit.unknowns
    result = differentiate(unknowns.compose, fit.values, unknowns.size, unknowns.bounds)
    assert [item is None for item in result] == [False, False, False, True]
    exact = central(arranged, fit.values, fit.prediction)
    # A one-sided difference of short step: what Newton's method leaves is some 2 % of it, see `fit.comparison`.
    slope = fit.jacobian[: len(exact), 3]
    assert np.linalg.norm(slope - exact) < 0.04 * np.linalg.norm(exact)


def central(arranged: Arrangement, values: np.ndarray, before: Prediction) -> np.ndarray:
    """Slope by bearing over a step that is long beside what Newton's method leaves."""
    ends, step = [], 5e-3
    for side in (-1, 1):
        moved = np.array(values)
        moved[3] += side * step
        model = arranged.fit.unknowns.compose(moved)
        ends.append(arranged.train.residual(arranged.train.predict(model, before)))
    return -(ends[1] - ends[0]) / (2 * step)


def test_at_its_upper_bound_it_is_differentiated_from_below(
    arranged: Arrangement, monkeypatch: pytest.MonkeyPatch
) -> None:
    train, unknowns = arranged.train, arranged.fit.unknowns
    *others, bearing = unknowns.effects
    assert isinstance(bearing, CalibrationParameter)
    parameter = replace(bearing.parameters[0], upper=1.0, typical=0.95)
    tight = replace(unknowns, effects=(*others, replace(bearing, parameters=(parameter,))))
    values = np.array([*arranged.fit.values[:3], 1.0])
    model = tight.compose(values)
    prediction, exact = train.predict(model), central(arranged, values, arranged.fit.prediction)
    seen: list[float] = []

    def watched(model: Model, factor: float) -> Model:
        seen.append(factor)
        return with_contact_position(model, factor)

    monkeypatch.setattr(accepted_parameters, "with_contact_position", watched)
    slopes = train.slopes(tight, values, model, prediction)
    assert max(seen) == 1.0
    assert min(seen) < 1.0 - 0.5 * STEP * tight.size[3]
    assert np.linalg.norm(slopes[:, 3] - exact) < 0.06 * np.linalg.norm(exact)
