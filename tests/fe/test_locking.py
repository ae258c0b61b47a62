"""How much too stiff the 8-node brick is in bending: parasitic shear, by a formula without a fitted number."""

from collections.abc import Callable

import numpy as np
import pytest

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX8, HEX20, Element
from fe.material import Material
from fe.mesh import Mesh
from fe.modal import modes

BoxMesher = Callable[..., Mesh]
LENGTH = 24.0  # in thicknesses: slender, so that true shear takes only 1e-3 off the frequency


def squared_frequency(box: BoxMesher, element: Element, counts: tuple[int, int, int], material: Material) -> float:
    """Of the first bending mode of a cantilever, twice as thick as wide: that about the stiff axis, along z."""
    mesh = box(element, counts=counts, size=(LENGTH, 0.5, 1.0))
    system = supported_system(mesh, *assemble(mesh, material), [Support(nodes=mesh.nodes("x0"))])
    result = modes(system, 3)
    reach = np.abs(system.on_mesh(result.mode_shapes)).max(axis=0)
    return float(result.frequency[np.flatnonzero(reach.argmax(axis=0) == 2)[0]] ** 2)


def excess(box: BoxMesher, cell_length: float, n: int, poisson: float) -> float:
    material = Material(young=210e9, poisson=poisson, density=7800.0)
    locked = squared_frequency(box, HEX8, (round(LENGTH / cell_length), 1, n), material)
    return locked / squared_frequency(box, HEX20, (48, 1, 2), material) - 1


@pytest.mark.parametrize("n", [1, 2, 4])
@pytest.mark.parametrize("cell_length", [0.5, 1.0, 2.0])
def test_without_contraction_the_excess_is_half_the_square_of_length_over_thickness(
    box: BoxMesher, cell_length: float, n: int
) -> None:
    # However many elements go through the thickness; the mode's own curvature over a cell takes 1e-3 of it.
    assert excess(box, cell_length, n, 0.0) == pytest.approx(cell_length**2 / 2, rel=3e-3)


@pytest.mark.parametrize("cell_length", [0.5, 1.0])
def test_with_contraction_the_rest_falls_with_the_square_of_the_elements_through_the_thickness(
    box: BoxMesher, cell_length: float
) -> None:
    nu = 0.3
    one, two = (excess(box, cell_length, n, nu) for n in (1, 2))
    # A layer keeps one strain along z where nu times a linear one should be: 1 / (1 - nu^2) - 1 as stiff again, over
    # n^2. The sides, which cannot bend either, add 0.02 whatever n is.
    assert (one - two) / (1 - 1 / 4) == pytest.approx(1 / (1 - nu**2) - 1, rel=0.05)
    assert two - cell_length**2 / (2 * (1 + nu)) == pytest.approx(0.1 / 4 + 0.02, abs=0.005)
