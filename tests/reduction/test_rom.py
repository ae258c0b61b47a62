"""Looking up, solving and recovering with a reduced model."""

import numpy as np
import pytest

from reduction.errors import RomError
from reduction.rom import ReducedModel

# Matrices of order one: a few units in the last place.
ROUND_OFF = 1e-12


def model(seed: int = 0, *, free_body: bool = False) -> ReducedModel:
    rng = np.random.default_rng(seed)
    r, n_node = 6, 4
    a, b = rng.standard_normal((2, r, r))
    mass, stiffness = a @ a.T + np.eye(r), b @ b.T + np.eye(r)
    if free_body:
        stiffness = b[:, :4] @ b[:, :4].T  # rank 4: two rigid-body motions
    return ReducedModel(
        mass=mass,
        damping=0.1 * mass + 0.01 * stiffness,
        stiffness=stiffness,
        boundary_node=np.array([3, 3, 1]),
        boundary_direction=np.array([1, 2, 1]),
        boundary_sets={"tip": np.array([0, 1]), "slot": np.array([2, 0])},
        fixed_interface_frequency=np.array([1.0, 2.0, 3.0]),
        recovery=rng.standard_normal((9, r)),
        free=np.arange(3, 12),
        n_node=n_node,
        provenance={"case": "a test"},
    )


def test_modes_solve_the_eigenproblem_and_are_mass_normalised() -> None:
    rom = model()
    modes = rom.modes()
    shapes, lambda_ = modes.mode_shapes, modes.angular_frequency**2
    np.testing.assert_allclose(shapes.T @ rom.mass @ shapes, np.eye(6), atol=ROUND_OFF)
    np.testing.assert_allclose(rom.stiffness @ shapes, rom.mass @ shapes * lambda_, atol=1e-10 * lambda_[-1])
    assert np.all(np.diff(lambda_) > 0)
    np.testing.assert_allclose(modes.damping_ratio, (0.1 + 0.01 * lambda_) / (2 * np.sqrt(lambda_)), rtol=1e-9)
    np.testing.assert_array_equal(rom.modes(2).mode_shapes, shapes[:, :2])


def test_a_free_body_has_its_rigid_motions_at_frequency_zero() -> None:
    rom = model(free_body=True)
    angular_frequency = rom.modes().angular_frequency
    # A square root halves the digits of a zero.
    assert np.all(angular_frequency[:2] < 1e-6 * angular_frequency[2])
    assert np.all(rom.modes().damping_ratio[2:] > 0)


def test_displacement_is_zero_where_fixed_and_the_recovery_elsewhere() -> None:
    rom = model()
    reduced = np.random.default_rng(1).standard_normal((6, 2, 3))
    field = rom.displacement(reduced)
    assert field.shape == (4, 3, 2, 3)
    np.testing.assert_array_equal(field[0], 0)
    np.testing.assert_allclose(field.reshape(12, 6)[3:], rom.recovery @ reduced.reshape(6, 6), atol=ROUND_OFF)
    complex_field = rom.displacement(reduced[:, 0, 0] + 2j * reduced[:, 1, 2])
    np.testing.assert_allclose(complex_field, field[..., 0, 0] + 2j * field[..., 1, 2], atol=ROUND_OFF)


def test_rows_are_found_by_set_name_and_direction() -> None:
    rom = model()
    np.testing.assert_array_equal(rom.rows("slot"), [2, 0])
    np.testing.assert_array_equal(rom.rows("tip", 2), [1])
    with pytest.raises(RomError, match=r'no boundary set "tpi": it has slot, tip'):
        rom.rows("tpi")
    with pytest.raises(RomError, match=r'"slot" has no degree of freedom in direction 2: it has 1'):
        rom.rows("slot", 2)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(RomError, match=r"shape \(5,\) cannot be recovered: .* the 6 coordinates"):
        model().displacement(np.zeros(5))
    with pytest.raises(RomError, match="7 modes were requested from a reduced model of 6"):
        model().modes(7)


def test_arrays_cannot_be_written() -> None:
    rom = model()
    for name in ("mass", "damping", "stiffness", "recovery", "free", "boundary_node"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(rom, name)[0] = 1
    with pytest.raises(TypeError):
        rom.boundary_sets["new"] = np.array([0])
