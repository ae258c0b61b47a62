"""Another density or stiffness of a part, and damping in proportion to both."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Model, Sensor, StructurePart
from diagnosis.effect.density import Density
from fe.dense_modes import compute_dense_modes
from hbsolve.balance import HarmonicBalance
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
