"""Another density or stiffness of a part, and damping in proportion to both."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Model, Sensor, StructurePart
from diagnosis.effect.density import Density
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.scoped_parameter import make_scoped_parameter
from fe.dense_modes import compute_dense_modes
from hbsolve.balance import HarmonicBalance
from reduction.elastic_support import ElasticBody, ElasticSupport
from reduction.jointed_system import JointedSystem, modal_damping

N_MASS = 12
#: Factors of mass and stiffness in the damping [1/s, s], and the dashpot at one mass [N s/m].
ALPHA, BETA, DASHPOT = 1.9, 3e-6, 40.0


def chain(rng: np.random.Generator, damping: str = "proportional") -> Model:
    """A grounded chain in two parts, of random masses and springs."""
    mass, springs = np.diag(rng.uniform(0.5, 2.0, N_MASS)), rng.uniform(1e5, 4e5, N_MASS)
    stiffness = np.diag(springs + np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    if damping == "proportional":
        matrix = ALPHA * mass + BETA * stiffness
        matrix[3, 3] += DASHPOT
    else:
        shapes = compute_dense_modes(mass, stiffness).mode_shapes
        matrix = mass @ shapes @ np.diag(rng.uniform(1.0, 9.0, N_MASS)) @ shapes.T @ mass
    force = np.zeros((2, N_MASS), dtype=np.complex128)
    force[1, -1] = 1.0
    share = np.diag(np.arange(N_MASS) < N_MASS // 2).astype(float)
    parts = [
        StructurePart(name=name, mass=item @ mass, stiffness=item @ stiffness @ item)
        for name, item in (("left", share), ("right", np.eye(N_MASS) - share))
    ]
    return Model(
        system=JointedSystem(mass=mass, damping=matrix, stiffness=stiffness, joints=[], harmonic_force=force),
        sensors=(Sensor(name="tip", row=np.eye(N_MASS)[-1]),), parts=tuple(parts), n_harmonic=3, n_sample=64,
    )  # fmt: skip


def is_dense(model: Model) -> bool:
    return HarmonicBalance(system=model.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample).is_dense


@pytest.mark.parametrize("seed", range(5))
def test_proportional_damping_follows_the_material_and_dashpots_stay(seed: int) -> None:
    model = chain(np.random.default_rng(seed))
    part = model.parts[1]
    mass, stiffness = model.system.mass + 0.3 * part.mass, model.system.stiffness - 0.1 * part.stiffness
    changed = model.with_material(mass, stiffness).system
    expected = ALPHA * mass + BETA * stiffness
    expected[3, 3] += DASHPOT
    np.testing.assert_array_equal(changed.mass, mass)
    np.testing.assert_array_equal(changed.stiffness, stiffness)
    # Round-off of the factors that are found in the matrices.
    np.testing.assert_allclose(changed.damping, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["E", "right.E"])
def test_calibrated_stiffness_takes_its_damping_along(name: str) -> None:
    model = chain(np.random.default_rng(2))
    if name == "E":
        parameter = next(item for item in list_calibration_parameters(model) if item.name == "E")
    else:
        parameter = make_scoped_parameter(model, name, 0.05)
    before, after = model.system, parameter.apply(model, [1.2]).system
    assert np.abs(after.stiffness - before.stiffness).max() > 0.1 * np.abs(before.stiffness).max()
    expected = before.damping + BETA * (after.stiffness - before.stiffness)
    np.testing.assert_allclose(after.damping, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_part_on_softer_springs_takes_its_damping_along() -> None:
    rng = np.random.default_rng(13)
    model = chain(rng)
    motion = rng.normal(size=(N_MASS, 6))
    support = ElasticSupport(
        motion=motion, inertia=model.system.mass @ motion, mass=motion.T @ model.system.mass @ motion,
        springs=np.eye(6), body=motion,
    )  # fmt: skip
    body = ElasticBody(mass=model.system.mass, stiffness=model.system.stiffness, support=support, compliance=0.0)
    held = replace(model, elastic_bodies={"right": body})
    before, after = held.system, held.with_elastic_body("right", replace(body, compliance=1e-7)).system
    assert np.abs(after.stiffness - before.stiffness).max() > 1e-3 * np.abs(before.stiffness).max()
    expected = before.damping + ALPHA * (after.mass - before.mass) + BETA * (after.stiffness - before.stiffness)
    np.testing.assert_allclose(after.damping, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(5))
def test_two_entries_do_not_make_damping_proportional(seed: int) -> None:
    """Of three degrees of freedom any damping agrees in two."""
    rng = np.random.default_rng(seed)
    mass, stiffness = np.diag([1.0, 2.0, 1.5]), np.array([[3e4, -1e4, 0.0], [-1e4, 2e4, -1e4], [0.0, -1e4, 1e4]])
    shapes = compute_dense_modes(mass, stiffness).mode_shapes
    damping = mass @ shapes @ np.diag(rng.uniform(1.0, 9.0, 3)) @ shapes.T @ mass
    model = Model(system=JointedSystem(mass=mass, damping=damping, stiffness=stiffness, joints=[]), sensors=())
    np.testing.assert_array_equal(model.with_material(1.5 * mass, stiffness).system.damping, damping)


def test_modes_uncouple_the_damping_of_a_heavier_part() -> None:
    model = chain(np.random.default_rng(7))
    heavier = Density(name="density of left", part="left").apply(model, [1.1])
    assert not is_dense(heavier)
    assert is_dense(heavier.with_system(damping=model.system.damping))


def test_modes_uncouple_the_damping_of_a_suspended_structure() -> None:
    rng = np.random.default_rng(5)
    model = chain(rng)
    shape = rng.normal(size=N_MASS)
    hung = replace(model, suspension=30.0 * np.outer(shape, shape))
    assert not is_dense(hung.without_contacts())
    suspended = model.system.stiffness + 30.0 * np.outer(shape, shape)
    assert is_dense(model.with_system(stiffness=suspended))


def test_damping_of_any_other_kind_stays() -> None:
    model = chain(np.random.default_rng(3), damping="modal")
    changed = model.with_material(1.1 * model.system.mass, model.system.stiffness)
    np.testing.assert_array_equal(changed.system.damping, model.system.damping)


def test_a_denser_structure_has_the_damping_ratio_that_half_mass_and_half_stiffness_give() -> None:
    model = chain(np.random.default_rng(11))
    system = model.system
    first = compute_dense_modes(system.mass, system.stiffness)
    omega, ratio = float(np.sqrt(first.lambda_[0])), 0.004
    damping = ratio * omega * system.mass + ratio / omega * system.stiffness
    denser = replace(model, system=replace(system, damping=damping)).with_material(1.02 * system.mass, system.stiffness)
    modes = compute_dense_modes(denser.system.mass, denser.system.stiffness)
    frequency = np.sqrt(modes.lambda_[:1])
    rate = modal_damping(denser.system, modes.mode_shapes[:, :1], frequency)[0]
    # zeta (sqrt(r) + 1 / sqrt(r)) / 2 is zeta to first order in r - 1: closed form of a proportional factor.
    assert rate / (2 * frequency[0]) == pytest.approx(ratio * (np.sqrt(1.02) + 1 / np.sqrt(1.02)) / 2, rel=1e-9)
