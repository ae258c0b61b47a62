"""Measure the discretisation error of the elements: tables of docs/elements.md.

    python benchmarks/elements.py

Order of convergence on bricks, on smoothly curved cells and on trapezoids whose shape is independent of the mesh size;
parasitic shear of the 8-node brick. Takes less than a minute.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX8, HEX20, Element
from fe.material import STEEL, Material
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes

Array = NDArray[np.float64]
Map = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
WALLS = {"u0": "x0", "u1": "x1", "v0": "y0", "v1": "y1", "w0": "z0", "w1": "z1"}
#: Size of the box [m]: thin in y, so that the first modes do not depend on y and one cell in y is sufficient.
SIZE = (1.0, 0.1, 0.6)


def bricks(_: int) -> Map:
    return lambda u, v, w: (SIZE[0] * u, SIZE[1] * v, SIZE[2] * w)


def bent(_: int) -> Map:
    """The same smooth map for all n: with a finer mesh the cells approach parallelepipeds."""

    def shape(u: Array, v: Array, w: Array) -> tuple[Array, Array, Array]:
        x = u + 0.1 * np.sin(np.pi * u) * np.cos(np.pi * w)
        z = w + 0.1 * np.sin(np.pi * w) * np.cos(np.pi * u)
        return SIZE[0] * x, SIZE[1] * v, SIZE[2] * z

    return shape


def trapezoids(n: int) -> Map:
    """Every second row of nodes is displaced up and down by 0.4 of a cell for every n."""

    def shape(u: Array, v: Array, w: Array) -> tuple[Array, Array, Array]:
        up_and_down, odd_row = 2 * np.abs(u * n % 2 - 1) - 1, 1 - np.abs(w * n % 2 - 1)
        return SIZE[0] * u, SIZE[1] * v, SIZE[2] * (w + 0.4 / n * up_and_down * odd_row)

    return shape


def shear_error(element: Element, family: Callable[[int], Map], n: int) -> float:
    """Relative error of omega^2 of the first shear mode of a box with sliding walls."""
    mesh = mesh_blocks([Block(shape=family(n), counts=(n, 1, n), faces=WALLS)], element)
    walls = [Support(nodes=mesh.nodes(wall), directions=("xyz".index(wall[0]),)) for wall in WALLS.values()]
    result = modes(supported_system(mesh, *assemble(mesh, STEEL), walls), 2).angular_frequency[1]
    exact = np.sqrt(STEEL.shear / STEEL.density) * np.pi * np.hypot(1 / SIZE[0], 1 / SIZE[2])
    return float(result**2 / exact**2 - 1)


def bending_frequency(element: Element, width: float, counts: tuple[int, int, int], material: Material) -> float:
    """First bending frequency along z of a cantilever of length 24 and thickness 1 [Hz]."""
    block = Block(shape=lambda u, v, w: (24 * u, width * v, w), counts=counts, faces={"u0": "root"})
    mesh = mesh_blocks([block], element)
    system = supported_system(mesh, *assemble(mesh, material), [Support(nodes=mesh.nodes("root"))])
    result = modes(system, 3)
    reach = np.abs(system.on_mesh(result.mode_shapes)).max(axis=0)
    return float(result.frequency[np.flatnonzero(reach.argmax(axis=0) == 2)[0]])


def print_orders() -> None:
    counts = (4, 8, 16, 32, 48)
    print("| element | cells | " + " | ".join(f"n = {n}" for n in counts) + " | order between them |")
    print("|" + "---|" * (len(counts) + 3))
    for element in (HEX8, HEX20):
        for family in (bricks, bent, trapezoids):
            errors = [shear_error(element, family, n) for n in counts]
            orders = [
                np.log(a / b) / np.log(m / k) for (a, b), (k, m) in zip(pairwise(errors), pairwise(counts), strict=True)
            ]
            values = " | ".join(f"{error:.1e}" for error in errors)
            print(
                f"| {element.name} | {family.__name__} | {values} | {', '.join(f'{order:.2f}' for order in orders)} |"
            )


def print_locking() -> None:
    print("| nu | width / t | hx / t | n | (f/f0)^2 - 1 | shear term | the rest |\n|" + "---|" * 7)
    for poisson in (0.0, 0.3):
        material = Material(young=STEEL.young, poisson=poisson, density=STEEL.density)
        for width in (0.5, 4.0):
            reference = bending_frequency(HEX20, width, (60, max(1, int(2 * width)), 2), material)
            for length in (0.5, 1.0, 2.0):
                for n in (1, 2, 4):
                    counts = (round(24 / length), max(1, round(width / length)), n)
                    excess = (bending_frequency(HEX8, width, counts, material) / reference) ** 2 - 1
                    shear = length**2 / (2 * (1 + poisson))
                    print(
                        f"| {poisson} | {width} | {length} | {n} | {excess:.4f} | {shear:.4f} | {excess - shear:.4f} |"
                    )


if __name__ == "__main__":
    print_orders()
    print()
    print_locking()
