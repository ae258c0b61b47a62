"""A small attached resonator: planted as a degree of freedom of its own, which the model lacks."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Dof, LineSensor, Model
from correlation.noise.nuisance import Budget
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.model_error_share import list_covariances
from diagnosis.resonator import DAMPING, Resonator, find_resonators, list_tunings
from diagnosis.unknown_force import compute_excess_gain, find_unknown_forces
from reduction.jointed_system import along
from tests.slow import slow

EXACT = Budget(frequency=0.0, compliance=0.0)
#: Of the absorber, in the tested band; a quarter of a per mille of the mass at the tip.
MASS, NATURAL, RATIO = 2e-4, 25.4, 0.02


def with_absorber(model: Model, row: np.ndarray) -> Model:
    """The model with a mass on a damped spring that hangs at a row."""
    system, omega, between = model.system, 2 * np.pi * NATURAL, np.append(row, -1.0)

    def grown(matrix: np.ndarray) -> np.ndarray:
        return np.pad(matrix, ((0, 1), (0, 1)))

    def longer(rows: np.ndarray) -> np.ndarray:
        return np.append(rows, np.zeros((*rows.shape[:-1], 1)), axis=-1)

    joints = [replace(j, normal=longer(j.normal), tangents=longer(j.tangents)) for j in system.joints]
    mass = grown(system.mass)
    mass[-1, -1] = MASS
    changed = replace(
        system, mass=mass, joints=joints, static_load=longer(system.static), harmonic_force=longer(system.dynamic),
        stiffness=grown(system.stiffness) + MASS * omega**2 * np.outer(between, between),
        damping=grown(system.damping) + 2 * RATIO * MASS * omega * np.outer(between, between),
    )  # fmt: skip
    sensors = tuple(s if isinstance(s, LineSensor) else replace(s, row=longer(s.row)) for s in model.sensors)
    places = {name: longer(place) for name, place in model.places.items()}
    return replace(model, system=changed, sensors=sensors, parts=(), dofs=(*model.dofs, Dof()), places=places)


def calibration(model: Model) -> list[CalibrationParameter]:
    return list_calibration_parameters(model, deviation={"kn": 0.0, "E": 0.0})


def arranged(small: Model, paper: ModuleType, truth: Model) -> Arrangement:
    return arrange(paper.make_campaign(truth, seed=3), small, calibration(small), EXACT)


def found_in(arrangement: Arrangement) -> list[Resonator]:
    return find_resonators(arrangement, list_covariances(arrangement))


@pytest.fixture(scope="module")
def hung(small: Model, paper: ModuleType) -> Arrangement:
    return arranged(small, paper, with_absorber(small, along(4, {2: 1.0})))


def test_an_absorber_is_found_with_place_mass_and_tuning(hung: Arrangement) -> None:
    best = found_in(hung)[0]
    assert (best.name, best.configuration) == ("tip z", "jointed")
    # The grid of natural frequencies is as coarse as the damping ratio.
    assert best.frequency == pytest.approx(NATURAL, rel=RATIO)
    assert best.damping == RATIO
    assert best.mass == pytest.approx(MASS, rel=0.2)  # beside what the grid and the first order leave
    # A force of one stiffness at all frequencies of a level explains less, though it has more parameters.
    assert find_unknown_forces(hung)[0] == best
    assert f"kg at {best.name} or " not in best.sentence  # two sensors tell the shape of its force


def test_places_that_move_alike_are_all_told_with_the_mass_there(hung: Arrangement) -> None:
    half = hung.fit.model.places["tip z"] / 2
    model = replace(hung.fit.model, places={**hung.fit.model.places, "lever z": half})
    best, other = found_in(replace(hung, fit=replace(hung.fit, model=model)))[:2]
    assert {best.name, other.name} == {"tip z", "lever z"}
    ((name, mass),) = [(item.name, item.mass) for item in best.alike]
    assert (name, mass) == (other.name, other.mass)
    masses = {item.name: item.mass for item in (best, other)}
    # A quarter of the motion's square is felt at half of the motion.
    assert masses["lever z"] == pytest.approx(4 * masses["tip z"])
    assert f" g at {best.name} or {1e3 * mass:.2g} g at {name} (to first order), in the jointed" in best.sentence


def test_at_an_angle_it_is_a_moment_of_inertia(hung: Arrangement) -> None:
    model = hung.fit.model
    turned = replace(model, dofs=tuple(replace(dof, direction="rx") for dof in model.dofs))
    best = found_in(replace(hung, fit=replace(hung.fit, model=turned)))[0]
    assert f"{best.mass:.2g} kg m^2 at tip z" in best.sentence


def test_without_one_the_best_gains_what_chance_does(small: Model, paper: ModuleType) -> None:
    arrangement = arranged(small, paper, small)
    n_tried = sum(len(list_tunings(np.array(grid))) * 2 for grid in paper.GRID.values())
    # The best of so many squares of normals, each of its own: exceeded once in a thousand at twice that much, as in
    # the test of forces without one.
    assert max(compute_excess_gain(item) for item in found_in(arrangement)) < 4 * np.log(1e3 * n_tried)


def test_tunings_cover_the_band_more_densely_than_resonances_are_wide() -> None:
    tunings = list_tunings(np.array([20.0, 30.0]))
    for ratio in DAMPING:
        natural = np.array([frequency for frequency, damping in tunings if damping == ratio])
        assert natural[0] < 20.0
        assert natural[-1] > 30.0
        assert np.diff(np.log(natural)).max() <= ratio


@pytest.fixture(scope="module")
def found(small: Model, paper: ModuleType) -> Diagnosis[Arrangement]:
    campaign = paper.make_campaign(with_absorber(small, along(4, {2: 1.0})), seed=3)
    return diagnose(campaign, small, calibration(small), EXACT)


@slow
def test_it_is_none_of_the_known_effects(found: Diagnosis[Arrangement]) -> None:
    assert found.verdict.finding is Finding.UNKNOWN
    assert "a small attached resonator at" in found.verdict.sentence
