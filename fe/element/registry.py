"""Registry of elements: one file each in this folder, and elements of other packages."""

from collections.abc import Iterator, Mapping

import numpy as np

from fe.element.table import BRICK, Element
from geometry.registry import Registry

#: Tolerance for round-off of shape functions, which are sums of about twenty products of numbers near one.
ROUND_OFF = 1e-12
#: Imaginary step of the check of gradients; complex steps have no cancellation error.
STEP = 1e-30


class _ByCellType(Mapping[str, Element]):
    """Registered elements by meshio's name of the cell."""

    def __getitem__(self, cell_type: str) -> Element:
        for element in REGISTRY:
            if element.cell_type == cell_type:
                return element
        raise KeyError(cell_type)

    def __iter__(self) -> Iterator[str]:
        return iter([element.cell_type for element in REGISTRY])

    def __len__(self) -> int:
        return len(REGISTRY)


def _wrong(element: Element) -> str | None:
    """Contradiction in the table of an element, as the end of a sentence; None if there is none."""
    n_node, corner_faces = element.n_node, element.corner_faces
    sides = [(a, b) for face in corner_faces for a, b in zip(face, (*face[1:], face[0]), strict=True)]
    if any(element.cell_type == other.cell_type for other in REGISTRY):
        return f'has the cell_type "{element.cell_type}" of another element: each element needs a different cell type'
    if {node for face in element.faces for node in face} - set(range(n_node)):
        return f"has faces with nodes beyond its {n_node}: number them from 0"
    if {*map(len, corner_faces)} - {3, 4} or len({*sides}) < len(sides) or {(b, a) for a, b in sides} != {*sides}:
        return "has faces that do not enclose it: give each its three or four corners anticlockwise from outside"
    if sorted(element.abaqus_faces) != list(range(len(element.faces))):
        return f"has {len(element.faces)} faces, but abaqus_faces {element.abaqus_faces}: name each face once"
    if sorted(element.gmsh_order) != list(range(n_node)):
        return f"has {n_node} nodes, but gmsh_order {element.gmsh_order}: name each node once"
    points, weights = element.rule
    if len(points) != len(weights) or len(element.stress_points) != element.n_corner:
        return f"needs a weight for each point of its rule, and {element.n_corner} stress_points, one per corner"
    corners = element.nodes[: element.n_corner]
    for shape, nodes in ((element.shape, element.nodes), (element.corner_shape, corners)):
        if not np.allclose(shape(nodes), np.eye(len(nodes)), atol=ROUND_OFF):
            return "has shape functions that are not 1 at their own node and 0 at the others: correct shape or nodes"
    slope = np.stack([np.imag(element.shape(points + 1j * STEP * axis)) / STEP for axis in np.eye(3)], axis=-1)
    if not np.allclose(element.gradient(points), slope, atol=ROUND_OFF):
        return "has a gradient that is not the derivative of its shape functions: correct gradient"
    brick, places = element.from_brick(np.arange(len(BRICK))[None])
    if places.shape[1] != n_node:
        return f"has {n_node} nodes, but from_brick makes cells of {places.shape[1]}: name each node's place"
    volume = np.linalg.det(np.einsum("cai,pax->cpix", BRICK[places] - 1.0, element.gradient(points))) @ weights
    if brick.any() or not np.isclose(volume.sum(), 8) or volume.min() <= 0:
        return f"fills {volume.sum() / 8:.3g} of a brick: correct from_brick, or the rule's weights"
    return None


REGISTRY: Registry[Element] = Registry(
    "element",
    package="fe.element",
    group="stickslip.elements",
    facts=dict.fromkeys(Element.__dataclass_fields__, "see `fe.element.table.Element`"),
    check=_wrong,
)
#: All elements by meshio's name of the cell.
ELEMENTS: Mapping[str, Element] = _ByCellType()
