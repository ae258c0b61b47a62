"""Springs between two nodes in a deck for CalculiX: lines as its manual has them, and a chain of two masses."""

from pathlib import Path

import numpy as np
import pytest

from fe.calculix_run import find_ccx, run_frequency
from fe.element import HEX8
from fe.file.calculix_deck import NodeSpring, write_calculix
from fe.material import Material
from fe.mesh import Mesh

SIDE, STIFFNESS = 0.1, 1e4  # m, N/m
MATERIAL = Material(young=1e11, poisson=0.3, density=8000.0)
OBLIQUE = np.array([0.6, 0.8, 0.0])
#: The blocks give a little themselves: a corner of one is as stiff as young * side, 1e6 times a spring.
RIGID = 1e-5


def blocks(count: int) -> Mesh:
    """Cubes in a row, each with nodes of its own."""
    points = [0.5 * SIDE * HEX8.nodes + np.array([2 * SIDE * k, 0, 0]) for k in range(count)]
    return Mesh(points=np.concatenate(points), cells={HEX8.cell_type: np.arange(8 * count).reshape(count, 8)})


def between(node: int, other: int) -> NodeSpring:
    return NodeSpring(node=node, other=other, direction=OBLIQUE, stiffness=STIFFNESS)


def test_a_spring_is_an_element_along_the_first_axis_of_its_own_frame(tmp_path: Path) -> None:
    deck = tmp_path / "a.inp"
    write_calculix(blocks(2), deck, MATERIAL, np.empty((0, 2)), 1, springs=[between(1, 8), between(7, 15)])
    lines = deck.read_text().splitlines()
    start = lines.index("*ORIENTATION, NAME=FRAME_1, SYSTEM=RECTANGULAR")
    # CalculiX manual, *ORIENTATION: a point on the local x axis and one in the local x-y plane, six numbers.
    # *SPRING for SPRING2: the two degrees of freedom, then the constant with its decimal point, without which CalculiX
    # takes it for a degree of freedom. Elements are numbered on from those of the mesh.
    ahead = np.array([float(number) for number in lines[start + 1].split(",")])
    np.testing.assert_array_equal(ahead[:3], OBLIQUE)
    assert np.linalg.norm(np.cross(ahead[:3], ahead[3:])) > 0.5
    assert lines[start + 2 : start + 7] == [
        "*ELEMENT, TYPE=SPRING2, ELSET=SPRING_1",
        "3, 2, 9",
        "*SPRING, ELSET=SPRING_1, ORIENTATION=FRAME_1",
        "1, 1",
        "1.000000000000E+04",
    ]
    assert "4, 8, 16" in lines
    assert lines.index("*SPRING, ELSET=SPRING_2, ORIENTATION=FRAME_2") < lines.index("*STEP")


@pytest.mark.calculix
@pytest.mark.skipif(find_ccx() is None, reason="CalculiX is not installed: apt-get install calculix-ccx")
def test_two_masses_on_springs_vibrate_as_their_closed_form_says() -> None:
    """Wall, spring, mass, spring, mass: omega^2 = (3 -+ sqrt 5) / 2 k / m, with k what a spring has along x."""
    mesh = blocks(3)
    wall = [(node, direction) for node in range(8) for direction in (0, 1, 2)]
    guides = [(node, direction) for node in range(8, 24) for direction in (1, 2)]
    result = run_frequency(mesh, MATERIAL, np.array(wall + guides), 2, [between(1, 8), between(9, 16)])
    k, m = STIFFNESS * OBLIQUE[0] ** 2, MATERIAL.density * SIDE**3
    exact = np.sqrt((3 + np.array([-1, 1]) * np.sqrt(5)) / 2 * k / m) / (2 * np.pi)
    np.testing.assert_allclose(result, exact, rtol=RIGID)
