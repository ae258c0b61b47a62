"""Fixtures of the tests of `fe`: every element, every factorisation, a box whose inside is distorted."""

from collections.abc import Callable

import numpy as np
import pytest

from fe.element import ELEMENTS, Element
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.sparse.solver import Backend, is_available

BoxMesher = Callable[..., Mesh]
#: The six walls of a box, in the order of the axes: face sets of every box mesh.
WALLS = {"u0": "x0", "u1": "x1", "v0": "y0", "v1": "y1", "w0": "z0", "w1": "z1"}


@pytest.fixture(scope="session", params=list(ELEMENTS.values()), ids=lambda element: element.name)
def element(request: pytest.FixtureRequest) -> Element:
    """Each element in turn: a new one is tested without a word here."""
    result: Element = request.param
    return result


@pytest.fixture(scope="session", params=list(Backend), ids=lambda backend: backend.value)
def backend(request: pytest.FixtureRequest) -> Backend:
    """Each factorisation in turn, as far as it is installed."""
    result: Backend = request.param
    if not is_available(result):
        pytest.skip(f"{result.value} is not installed")
    return result


def _box_mesh(
    element: Element,
    counts: tuple[int, int, int] = (3, 3, 3),
    size: tuple[float, float, float] = (1.0, 0.8, 0.6),
    distortion: float = 0.0,
    bow: float = 0.0,
    seed: int = 0,
) -> Mesh:
    """A box [0, size] whose six walls stay flat, so that its volume is known whatever happens inside.

    Corner nodes move by up to `distortion`, midside nodes off the middle of their edge by up to `bow`, each a part of
    the cell's size.
    """
    box = Block(shape=lambda u, v, w: (size[0] * u, size[1] * v, size[2] * w), counts=counts, faces=WALLS)
    mesh = mesh_blocks([box], element)
    generator = np.random.default_rng(seed)
    noise = generator.uniform(-1, 1, (2, mesh.n_node, 3)) * np.array(size) / counts
    if element.n_corner < 8:
        noise /= 2  # several to a brick: they are as much thinner
    within = (mesh.points > 1e-9) & (mesh.points < np.array(size) - 1e-9)
    points = mesh.points + distortion * noise[0] * within
    (cells,) = mesh.cells.values()
    # Edges are straight before they are bowed: every node goes where the map of the corners puts it.
    straight = np.einsum("ac,eci->eai", element.corner_shape(element.nodes), points[cells[:, : element.n_corner]])
    points[cells] = straight
    midside = np.setdiff1d(np.arange(mesh.n_node), mesh.corner_nodes())
    points[midside] += (bow * noise[1] * within)[midside]
    n_cell = mesh.n_cell
    half = {"low": np.arange(n_cell // 2), "high": np.arange(n_cell // 2, n_cell)}
    return Mesh(points=points, cells=mesh.cells, face_sets=mesh.face_sets, cell_sets=half)


@pytest.fixture(scope="session")
def box() -> BoxMesher:
    """The mesher of boxes."""
    return _box_mesh
