"""Where a force is missing, and of what sort: planted springs, dashpots and cubics are told by exponent and phase."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.place import ANGULAR, LINEAR, with_cubic_spring
from diagnosis.fit.arrangement import arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.localisation import UnknownForcePlace, _fit_force, find_common_phase, localise
from diagnosis.model_error_share import ProjectedCovariance, list_covariances
from reduction.jointed_system import along

TIP = along(4, {2: 1.0})
SPRING, DASHPOT, CUBIC = 20.0, 0.15, 8e6  # N/m, N s/m, N/m^3


def located(
    model: Model, paper: ModuleType, truth: Model, *, has_phase: bool = True, **known: float
) -> list[UnknownForcePlace]:
    campaign = paper.make_campaign(truth, seed=8)
    deviation = {"kn": 0.0, "E": 0.0, **known}
    arrangement = arrange(
        campaign,
        model,
        list_calibration_parameters(model, deviation=deviation),
        Budget(frequency=0.0, compliance=0.0),
    )
    observed = arrangement.train.observed
    observed = replace(observed, phased=np.full(len(observed.points), has_phase))
    arrangement = replace(arrangement, train=replace(arrangement.train, observed=observed))
    return localise(arrangement, list_covariances(arrangement))


def spring(model: Model) -> Model:
    return model.with_system(stiffness=model.system.stiffness + SPRING * np.outer(TIP, TIP))


def added_mass(model: Model) -> Model:
    return model.with_system(mass=model.system.mass + 1e-3 * np.outer(TIP, TIP))


def near(found: float, exact: float, deviation: float, share: float = 0.0) -> bool:
    """Within four standard deviations, and the share that a linear fit is off."""
    return abs(found - exact) < 4 * deviation + share * abs(exact)


def test_a_spring_is_linear_and_opposite_to_the_displacement(small: Model, paper: ModuleType) -> None:
    best = located(small, paper, spring(small))[0]
    assert best.name == "tip z"
    assert near(best.exponent, 1.0, best.exponent_deviation)
    assert best.exponent_deviation < 0.05
    assert abs(best.phase) == pytest.approx(180, abs=5)
    for kappa, deviation in zip(best.stiffness, best.deviation, strict=True):
        # The spring moves the resonance by 0.1 % of 3 % of width: 3 % of curvature.
        assert near(kappa.real, SPRING, deviation, 0.03)
    assert "power 1.0" in best.sentence
    assert "near tip z" in best.sentence
    assert best.units is LINEAR


def test_where_no_sensor_has_a_phase_none_is_told(small: Model, paper: ModuleType) -> None:
    best = located(small, paper, spring(small), has_phase=False)[0]
    assert best.phase is None
    assert "deg" not in best.sentence


def test_a_cubic_spring_is_told_by_its_exponent(
    small: Model, paper: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    # 4 N/m at the lower level are seen; 17 N/m at the higher, 0.1 % of the stiffness, change the response straight on.
    monkeypatch.setattr(paper, "LEVELS", (0.6, 1.2))
    best = located(small, paper, with_cubic_spring(small, "cubic", TIP, CUBIC))[0]
    assert best.name == "tip z"
    assert near(best.exponent, 3.0, best.exponent_deviation)
    assert best.exponent_deviation < 0.3
    assert abs(best.phase) == pytest.approx(180, abs=5)
    # The describing function of k u^3 is 3/4 k a^2; it shifts the resonance by some 2 % of its width.
    assert best.stiffness[-1].real == pytest.approx(0.75 * CUBIC * best.amplitude[-1] ** 2, rel=0.05)


def test_a_dashpot_is_an_imaginary_stiffness_of_its_size(small: Model, paper: ModuleType) -> None:
    damped = small.with_system(damping=small.system.damping + DASHPOT * np.outer(TIP, TIP))
    result = located(small, paper, damped, zeta=0.0)
    best = result[0]
    assert best.name == "tip z"
    assert best.configuration == "free"
    assert near(best.exponent, 1.0, best.exponent_deviation)
    assert best.phase == pytest.approx(-90, abs=10)
    omega = 2 * np.pi * paper.GRID[True][3]  # the frequency next to the resonance
    for kappa, deviation in zip(best.stiffness, best.deviation, strict=True):
        # Both parts of kappa are known alike well, in N/m.
        assert near(kappa.imag, omega * DASHPOT, deviation, 0.03)


def test_a_mass_is_in_phase(small: Model, paper: ModuleType) -> None:
    best = located(small, paper, added_mass(small))[0]
    assert best.name == "tip z"
    assert best.phase == pytest.approx(0, abs=5)
    assert near(best.exponent, 1.0, best.exponent_deviation)


def test_when_nothing_is_missing_every_place_gains_what_chance_does(small: Model, paper: ModuleType) -> None:
    for place in located(small, paper, small):
        # chi-square of eight numbers: 26.1 once in a thousand; twice that for covariances known from four repeats.
        assert place.gain < 52
        # Real and imaginary parts of a stiffness and of a third harmonic's force.
        parts = {"jointed": 4, "free": 2}[place.configuration]  # no third harmonics were measured without contacts
        assert place.n_number == parts * len(paper.LEVELS)


@pytest.mark.filterwarnings("error")
def test_a_place_that_does_not_move_explains_nothing(small: Model, paper: ModuleType) -> None:
    """Without contacts the structure does not move in x at all."""
    model = replace(small, places={**small.places, "root x": along(4, {1: 1.0})})
    result = {(place.name, place.configuration): place for place in located(model, paper, spring(model))}
    still = result["root x", "free"]
    assert still.gain == 0
    assert not np.any(still.stiffness)
    assert still.exponent_deviation == np.inf
    assert np.isfinite(still.phase)


def test_a_place_is_found_alike_well_whatever_the_size_of_its_motion() -> None:
    """The change by 1 N/m is smaller than that by 1 N as the motion is."""
    random, levels, amplitude = np.random.default_rng(5), np.array([1.0, 2.0]), np.array([1.0, 2.5])
    changes, force = random.standard_normal((40, 8)), np.array([9.0, 1.0, 20.0, 3.0, -4.0, 0.0, -8.0, 1.0])
    weights = ProjectedCovariance(np.asarray, np.zeros((40, 0)), changes @ force, 0.0)  # type: ignore[arg-type]
    large, small = (
        _fit_force("tip", False, levels, size * amplitude, changes * np.array([size] * 4 + [1.0] * 4), weights)
        for size in (1.0, 1e-12)
    )
    assert (small.gain, small.exponent, small.phase) == pytest.approx((large.gain, large.exponent, large.phase))
    np.testing.assert_allclose(small.stiffness, 1e12 * large.stiffness)
    np.testing.assert_allclose(small.deviation, 1e12 * large.deviation)


def test_a_place_that_turns_is_loaded_by_moments(small: Model, paper: ModuleType) -> None:
    turning = replace(small, dofs=tuple(replace(dof, direction="rx") for dof in small.dofs))
    assert all(place.units is ANGULAR for place in located(turning, paper, small))


def test_a_force_that_turns_with_the_level_has_no_one_phase() -> None:
    spring, dashpot = -1.0 + 0j, -1j
    assert find_common_phase(np.array([spring, 3 * spring]), np.array([9.0, 9.0])) == pytest.approx(180)
    assert find_common_phase(np.array([3 * spring, dashpot]), np.array([9.0, 0.5])) == pytest.approx(180)
    assert find_common_phase(np.array([dashpot, -dashpot, spring]), np.array([9.0, 9.0, 9.0])) is None
