"""Contacts between two bodies of one mesh join the nodes that face each other, whatever the order of their sets."""

from pathlib import Path

import numpy as np
import pytest

from fe.element import HEX20
from fe.file.mesh_file import write_mesh
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from study.case.setup import read_case

CASE = """\
schema = 2
[structure]
kind = "part"
file = "two.vtu"
length_unit = "m"
[structure.material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
[structure.reduction]
modes = 2
[[structure.support]]
on = ["foot"]
[[structure.boundary]]
name = "upper"
on = "upper"
[[structure.boundary]]
name = "lower"
on = "lower"
[[line]]
name = "lap"
normal = { at = "upper", other_at = "lower", direction = "z" }
tangent = { at = "upper", other_at = "lower", direction = [0.6, 0.8, 0.0] }
normal_stiffness = "2 N/um"
tangential_stiffness = "1 N/um"
friction_coefficient = 0.3
preload = "11 N"
balanced_preload = true
"""


@pytest.mark.parametrize("order", ["the same", "another"])
def test_nodes_that_face_each_other_are_joined(order: str, at_home: Path) -> None:
    """The bodies stand 1 mm apart, so that no pair has the same place."""
    low = mesh_blocks([Block.box(((0, 0.05), (0, 0.02), (0, 0.01)), (3, 2, 1), {"w0": "foot", "w1": "face"})], HEX20)
    high = mesh_blocks([Block.box(((0, 0.05), (0, 0.02), (0.011, 0.02)), (3, 2, 1), {"w0": "face"})], HEX20)
    lower, upper = low.nodes("face"), high.nodes("face") + low.n_node
    if order == "another":
        lower = np.random.default_rng(3).permutation(lower)
    two = Mesh(
        points=np.vstack([low.points, high.points]),
        cells={"hexahedron20": np.vstack([low.cells["hexahedron20"], high.cells["hexahedron20"] + low.n_node])},
        node_sets={"foot": low.nodes("foot"), "lower": lower, "upper": upper},
    )
    write_mesh(two, at_home / "two.vtu")
    (at_home / "two.toml").write_text(CASE)
    model = read_case(at_home / "two.toml").model
    places = np.array([item.coordinates if item.coordinates is not None else [np.nan] * 3 for item in model.dofs])
    assert len(model.system.joints) == len(upper)
    for joint in model.system.joints:
        for row in (joint.normal, *np.atleast_2d(joint.tangents)):
            apart = np.ptp(places[np.flatnonzero(row)], axis=0)
            # Coordinates are those of the file to its last digit.
            np.testing.assert_allclose(apart, [0, 0, 0.001], atol=1e-12)
