"""A resonance that is far from all those of a model is told; one that contacts or a calibration may move is not."""

from dataclasses import replace
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import Observation, take_training_part
from correlation.model import Model
from correlation.prediction import Points
from diagnosis.decision.closeness import (
    MAX_RESONANCE_ERROR,
    MIN_PEAK_OVER_MEASURED,
    find_absent_peak,
    find_far_resonance,
    list_beyond_priors,
)
from diagnosis.effect.shift import Shift
from diagnosis.fit.calibration import Fit
from diagnosis.fit.calibration_parameter import CalibratedEffect, list_calibration_parameters
from diagnosis.fit.fit_parameter import Unknowns
from fe.dense_modes import compute_dense_modes
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.stuck import stick_at_rest


@pytest.fixture(scope="module")
def observed(small: Model, paper: ModuleType) -> Observation:
    campaign: Campaign = paper.make_campaign(small, seed=3)
    return take_training_part(campaign)


def scaled(model: Model, factor: float) -> Model:
    """All springs, of the structure and of its contacts, times a factor: frequencies go by its root."""
    joints = [
        joint.with_values(
            {name: factor * getattr(joint, name) for name in ("normal_stiffness", "tangential_stiffness")}
        )
        for joint in list_friction_contacts(model.system.joints)
    ]
    return model.with_system(stiffness=factor * model.system.stiffness, joints=joints)


@pytest.mark.parametrize("factor", [1.0, 0.95, 1.05])
def test_a_model_that_a_calibration_brings_near_is_close(observed: Observation, small: Model, factor: float) -> None:
    assert find_far_resonance(observed, scaled(small, factor**2)) is None


@pytest.mark.parametrize("factor", [0.8, 0.85])
def test_a_model_whose_first_resonance_is_too_low_is_told_with_both(
    observed: Observation, small: Model, factor: float
) -> None:
    far = find_far_resonance(observed, scaled(small, factor**2))
    assert far is not None
    assert far.nearest / far.measured == pytest.approx(factor, abs=0.05)
    assert f"{far.measured:.4g} Hz" in far.sentence
    assert f"{far.nearest:.4g} Hz" in far.sentence


def test_contacts_may_lower_a_resonance_to_that_without_them(observed: Observation, small: Model) -> None:
    """Stiffer contacts raise the upper end alone: they may slip."""
    joints = [
        joint.with_values({"tangential_stiffness": 10 * joint.tangential_stiffness})
        for joint in list_friction_contacts(small.system.joints)
    ]
    assert find_far_resonance(observed, small.with_system(joints=joints)) is None


def test_a_band_without_a_peak_tells_nothing(observed: Observation, small: Model) -> None:
    flat: Any = replace(observed, repeat=np.ones_like(observed.repeat))
    assert find_far_resonance(flat, scaled(small, (1 - 3 * MAX_RESONANCE_ERROR) ** 2)) is None


def test_a_predicted_peak_that_was_not_measured_is_told(observed: Observation) -> None:
    """Beyond its resonance a structure moves less and less over the band in which the model has its peak."""
    points = observed.points
    falling = (points.frequency.min() / points.frequency) ** 20 * points.force
    beyond: Any = replace(observed, repeat=np.broadcast_to(falling[:, None], observed.repeat.shape).astype(complex))
    peak = observed.value * 1e3 * MIN_PEAK_OVER_MEASURED / np.abs(observed.value).max() * np.abs(beyond.value).max()
    result = find_absent_peak(beyond, peak)
    assert result is not None
    assert points.frequency.min() < result.predicted < points.frequency.max()
    assert f"{result.predicted:.4g} Hz" in result.sentence
    # A peak that was measured, a small one and one of both are none.
    assert find_absent_peak(observed, observed.value) is None
    assert find_absent_peak(observed, peak) is None
    assert find_absent_peak(beyond, 1e-6 * peak) is None


#: Lines of a band with two modes [Hz].
BAND = np.linspace(20.0, 60.0, 401)


def respond(*modes: tuple[float, float]) -> Complex[NDArray[np.complex128], " f"]:
    """Response of modes with natural frequencies [Hz], so high each, over the band."""
    parts = [height * 0.02 / (1 - (BAND / own) ** 2 + 0.02j * BAND / own) for own, height in modes]
    return np.asarray(np.sum(parts, axis=0))


def observe(value: Complex[NDArray[np.complex128], " f"]) -> Observation:
    """One repeat of the tip at one level over the band, as far as the response goes."""
    one = np.ones(len(value), dtype=np.int64)
    points = Points(
        free=one == 0, level=1.0 * one, frequency=BAND[: len(value)], sensor=np.full(len(value), "tip"), harmonic=one,
        sweep=0 * one, force=1.0 * one,
    )  # fmt: skip
    return Observation(points=points, repeat=value[:, None], motion=one > 0, taken=(one > 0)[:, None])


@pytest.mark.parametrize("heights", [(1.0, 0.5), (0.5, 1.0)])
def test_each_of_two_modes_is_compared_whichever_is_higher(small: Model, heights: tuple[float, float]) -> None:
    second = compute_dense_modes(small.system.mass, small.system.stiffness).frequency[1]
    stuck = stick_at_rest(small.system.stiffness, small.system.joints)
    own = compute_dense_modes(small.system.mass, stuck).frequency[0]
    lacking = float(np.sqrt(own * second))
    assert lacking / own > 1 + 2 * MAX_RESONANCE_ERROR
    far = find_far_resonance(observe(respond((own, heights[0]), (lacking, heights[1]))), small)
    assert far is not None
    assert far.measured == pytest.approx(lacking, abs=0.1)  # a step of the frequencies
    assert find_far_resonance(observe(respond((own, heights[0]), (second, heights[1]))), small) is None


def test_a_resonance_that_was_measured_below_a_higher_flank_is_not_absent() -> None:
    # The band ends on the flank of the second mode, above the peak of the first.
    measured = respond((30.0, 0.1), (58.0, 1.0))[: np.searchsorted(BAND, 57.0)]
    assert np.argmax(np.abs(measured)) == len(measured) - 1
    predicted = respond((30.0, 1.0))[: len(measured)]
    assert find_absent_peak(observe(measured), predicted) is None
    # Without the first mode it is.
    assert find_absent_peak(observe(respond((58.0, 1.0))[: len(measured)]), predicted) is not None


def test_parameters_with_a_prior_that_a_fit_leaves_at_a_bound_are_held_back(small: Model) -> None:
    parameters = list_calibration_parameters(small)
    first, last = parameters[0], parameters[-1]
    unknowns = Unknowns.from_effects(small, [(first, first.deviation)], [last])
    values = unknowns.vanishing
    fit: Any = SimpleNamespace(unknowns=unknowns, values=values, is_beyond_priors=False)
    assert list_beyond_priors(fit) == ()
    values[1] = unknowns.bounds[1][1]  # a strength that no prior holds
    assert list_beyond_priors(fit) == ()
    values[0] = unknowns.bounds[0][1]
    assert list_beyond_priors(fit) == (f"{first.name} x {values[0]:.4g}",)


def test_a_calibrated_effect_that_is_held_back_is_told_in_its_unit(small: Model) -> None:
    shift = CalibratedEffect.from_effect(Shift(name="shift of lid", weight="lid"), 5e-4)
    unknowns = Unknowns.from_effects(small, [(shift, shift.deviation)], [])
    fit: Any = SimpleNamespace(unknowns=unknowns, values=np.array([unknowns.bounds[0][1]]), is_beyond_priors=False)
    assert list_beyond_priors(fit) == ("shift of lid = 0.0025 m",)


def test_parameters_that_are_together_beyond_their_priors_are_held_back_the_furthest_of_them(small: Model) -> None:
    parameters = list_calibration_parameters(small)
    unknowns = Unknowns.from_effects(small, [(item, item.deviation) for item in parameters], [])
    for residual, beyond_priors in ((1.0, 0), (2.5, len(parameters)), (1.9, 1)):
        residuals = np.full(len(parameters), residual)
        residuals[0] = max(residual, 3.0) if beyond_priors else residual
        values = unknowns.vanishing + residuals * unknowns.prior
        fit = Fit(
            unknowns=unknowns, values=values, covariance=np.eye(len(values)), chi2=0.0, model=small, prediction=None,
            residual=np.zeros(len(values)), jacobian=np.eye(len(values)),
        )  # fmt: skip
        # Of five parameters 5 is what chance expects; 18 is exceeded by 0.27 %.
        assert fit.is_beyond_priors == bool(beyond_priors)
        assert len(list_beyond_priors(fit)) == beyond_priors
