"""``[[load]]`` with base: the inertia load of a shaken base, or the sentence that says why there is none."""

import numpy as np
import pytest
import scipy.linalg

from correlation.model import Dof
from reduction.errors import JointError
from reduction.file.structure_file import StructureMatrices
from study.case.load_table import LoadTable
from study.case.model import find_base_motion
from study.case.structure import Structure


def structure(*directions: str) -> Structure:
    n = len(directions)
    matrices = StructureMatrices(mass=np.eye(n), damping=np.zeros((n, n)), stiffness=np.eye(n))
    return Structure(matrices=matrices, dofs=tuple(Dof(direction=item) for item in directions))


def test_a_base_moves_what_moves_along_its_axis() -> None:
    np.testing.assert_array_equal(find_base_motion(structure("x", "z", "z", "ry"), "z").motion, [0, 1, 1, 0])
    np.testing.assert_array_equal(find_base_motion(structure("modal", "modal"), (1.0, 0.5)).motion, [1.0, 0.5])


@pytest.mark.parametrize(
    ("directions", "base", "says"),
    [(("z", "modal"), "z", "does not contain"), (("x", "x"), "z", "along z"), (("z", "z"), (1.0,), "1 numbers for 2")],
)
def test_a_base_that_is_not_known_is_one_sentence(directions: tuple[str, ...], base: object, says: str) -> None:
    with pytest.raises(JointError, match=says):
        find_base_motion(structure(*directions), base)  # type: ignore[arg-type]


def test_the_list_that_the_refusal_names_moves_reduced_matrices_as_the_full_ones() -> None:
    n, omega = 8, 300.0
    stiffness = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    mass, motion = np.diag(np.linspace(1.0, 2.0, n)), np.ones(n)
    basis = scipy.linalg.eigh(stiffness, mass)[1][:, :4]
    small_mass, small_stiffness = (basis.T @ matrix @ basis for matrix in (mass, stiffness))
    kept = StructureMatrices(mass=small_mass, damping=np.zeros((4, 4)), stiffness=small_stiffness)
    listed = np.linalg.solve(small_mass, basis.T @ mass @ motion)
    load = -find_base_motion(Structure(matrices=kept, dofs=(Dof(),) * 4), tuple(listed)).inertia
    full = np.linalg.solve(stiffness - omega**2 * mass, -mass @ motion)
    reduced = basis @ np.linalg.solve(small_stiffness - omega**2 * small_mass, load)
    # What the four modes leave out is still at this frequency: their share falls with the fourth power of their number.
    np.testing.assert_allclose(reduced, full, atol=0.01 * np.abs(full).max())


def test_a_load_is_a_force_at_a_place_or_a_base() -> None:
    assert LoadTable.model_validate({"base": "z"}).base == "z"
    for wrong in (
        {"base": "z", "dof": 0},
        {},
        {"base": "z", "amplitude": "3 N"},
        {"dof": 0, "displacement": "1 mm"},
        {"base": "z", "velocity": "1 mm/s", "displacement": "1 mm"},
    ):
        with pytest.raises(ValueError, match="base"):
            LoadTable.model_validate(wrong)
