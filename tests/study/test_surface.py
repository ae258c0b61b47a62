"""The outside of a reduced body: closed, as large as the body, and moving as its nodes do."""

import numpy as np
import pytest

from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from geometry.plain_blade import PlainBlade
from reduction.craig_bampton import craig_bampton
from study.case import surface
from study.case.surface import list_outer_triangles, make_surface, thin_surface


@pytest.fixture(scope="module")
def bar() -> Mesh:
    rule = MeshRule(element=HEX20, through_thickness=1, length_ratio=2.4, length_cap=0.02)
    return mesh_plain_blade(PlainBlade(), rule)


def enclosed(points: np.ndarray, triangles: np.ndarray) -> float:
    """Volume within a closed surface, by Gauss's theorem."""
    a, b, c = (points[corner] for corner in triangles.T)
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6)


def test_triangles_enclose_the_volume_of_the_cells(bar: Mesh) -> None:
    # A straight bar of bricks has plane faces: the corners tell all.
    blade = PlainBlade()
    root = blade.root_chord * blade.root_thickness * blade.root_height
    volume = blade.chord * blade.thickness * blade.length + root
    assert enclosed(bar.points, list_outer_triangles(bar)) == pytest.approx(volume, rel=1e-9)


def test_a_thinned_sphere_has_few_points_and_is_one_still() -> None:
    n, around = 60, 120
    up, turn = np.linspace(0, np.pi, n + 1), np.arange(around) / around * 2 * np.pi
    points = np.stack([np.outer(np.sin(up), np.cos(turn)), np.outer(np.sin(up), np.sin(turn)),
                       np.outer(np.cos(up), np.ones(around))], axis=-1).reshape(-1, 3)  # fmt: skip
    corner = np.arange((n + 1) * around).reshape(n + 1, around)
    a, b, c, d = (
        item.ravel() for item in (corner[:-1], corner[1:], np.roll(corner, -1, 1)[1:], np.roll(corner, -1, 1)[:-1])
    )
    nodes, thin = thin_surface(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    assert 500 < len(nodes) <= surface.MOST_POINTS
    # Chords of a few degrees lose less than a hundredth.
    assert enclosed(points[nodes], thin) == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_it_moves_as_the_nodes_of_the_body_and_rests_where_they_are_fixed(bar: Mesh) -> None:
    mass, stiffness = assemble_compact(bar, STEEL)
    fixed = bar.nodes("clamp")
    system = supported_system(bar, mass, stiffness, [Support(nodes=fixed)])
    tip = int(bar.points[:, 0].argmax())
    rom = craig_bampton(system, {"tip": system.rows(np.array([tip]))}, 3)
    made = make_surface(bar, rom, slice(2, 2 + rom.n_dof), rom.n_dof + 4)
    q = np.random.default_rng(1).normal(size=rom.n_dof + 4)
    nodes = [int(np.flatnonzero((bar.points == point).all(axis=1))[0]) for point in made.points]
    np.testing.assert_allclose(made.motion @ q, rom.displacement(q[2:-2])[nodes], rtol=1e-9, atol=1e-12)  # round-off
    at_rest = np.isin(nodes, fixed)
    assert at_rest.any()
    assert not made.motion[at_rest].any()
