"""Damper, de-coupler and rig as cells: closed, conforming, of the right volume, and mating at the stations."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fe.element import ELEMENTS, HEX8, HEX20, Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.damper import DamperMesh, mesh_damper
from fe.mesher.decoupler import DecouplerMesh, mesh_decoupler
from fe.mesher.rig import choose_rig_mesh, mesh_rig
from geometry.damper import Damper
from geometry.decoupler import Decoupler
from geometry.errors import GeometryError
from geometry.rig import Rig, mating_pairs, named_points, placements
from tests.fe.surface import area_vectors, boundary, check_closed
from tests.geometry.decoupler_volume import groove_volume, volume

# Of a damper's section 16 parabolas miss 5e-5 and 16 chords 2.6 %; of a de-coupler's groove, the
# segment of a circle of 72 degrees to either side at most, 4 parabolas miss 4.3e-4 and 4 chords 8.4 %.
CURVED = {"damper": {"hex8": 0.03, "hex20": 1e-4}, "groove": {"hex8": 0.09, "hex20": 5e-4}}
# A solver warns below 0.2; 0.51 was measured, where the stubs of the two arms start from one edge.
SOUND = 0.45
# The least that a search over the dimensions below found is 0.19: the thinnest arms, the steepest, that meet first.
SOUND_AT_WORST = 0.15


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


@pytest.fixture(scope="module", params=[HEX8, HEX20], ids=["hex8", "hex20"])
def meshes(request: pytest.FixtureRequest, rig: Rig) -> dict[str, Mesh]:
    return mesh_rig(rig, choose_rig_mesh(rig, request.param, 0.003))


def test_bodies_have_their_volumes_and_sound_cells(meshes: dict[str, Mesh], rig: Rig) -> None:
    expected = {"damper": rig.damper.volume, "decoupler": volume(rig.decoupler)}
    curved = {"damper": rig.damper.volume, "decoupler": groove_volume(rig.decoupler)}
    missed = {"damper": CURVED["damper"], "decoupler": CURVED["groove"]}
    for body, cells in meshes.items():
        quality = measure_cell_quality(cells)
        assert quality.scaled_jacobian.min() > SOUND
        if body == "blade":  # tests of its own
            continue
        kind = body.partition("_")[0]
        name = ELEMENTS[next(iter(cells.cells))].name
        assert quality.volume.sum() == pytest.approx(expected[kind], rel=0, abs=missed[kind][name] * curved[kind])


def test_surfaces_are_closed(meshes: dict[str, Mesh]) -> None:
    for cells in meshes.values():
        check_closed(cells)


def test_faces_are_on_the_surface_and_cells_end_where_they_are_fixed(meshes: dict[str, Mesh], rig: Rig) -> None:
    points = named_points(rig)
    for body in ("decoupler_left", "decoupler_right"):
        cells = meshes[body]
        outside = {tuple(face) for face in boundary(cells).tolist()}
        for name in ("groove", "pad", "cell_upper", "cell_lower"):
            assert {tuple(face) for face in cells.face_sets[name].tolist()} <= outside
        for name in ("cell_upper", "cell_lower"):
            assert area_vectors(cells, cells.face_sets[name])[1].sum() == pytest.approx(
                rig.decoupler.width * rig.decoupler.cell_thickness, rel=1e-12
            )
            np.testing.assert_allclose(cells.points[cells.nodes(name)].mean(axis=0), points[body][name], atol=1e-12)
    for body in ("damper_left", "damper_right"):
        outside = {tuple(face) for face in boundary(meshes[body]).tolist()}
        named = np.concatenate([*meshes[body].face_sets.values()])
        # A damper's faces are its whole surface.
        assert {tuple(face) for face in named.tolist()} == outside


def test_stations_of_mating_lines_are_corner_nodes_at_one_place(meshes: dict[str, Mesh], rig: Rig) -> None:
    names = {"left_blade": "contact_negative", "right_blade": "contact_positive"}
    for name, pair in mating_pairs(rig).items():
        damper, other = meshes[pair.damper], meshes[pair.other]
        nodes = damper.node_sets[pair.damper_line.name], other.node_sets[names.get(name, "contact")]
        # A nanometre, of a micrometre that the lines of the geometry may be apart.
        np.testing.assert_allclose(damper.points[nodes[0]], other.points[nodes[1]], atol=1e-9)
        np.testing.assert_allclose(damper.points[nodes[0]], pair.damper_line.stations, atol=1e-9)
        assert np.isin(nodes[0], damper.corner_nodes()).all()
        assert np.isin(nodes[1], other.corner_nodes()).all()


def test_points_are_nodes_where_they_should_be(meshes: dict[str, Mesh], rig: Rig) -> None:
    for body, points in named_points(rig).items():
        for name, point in points.items():
            if name in {"cell_upper", "cell_lower"}:  # faces
                continue
            (node,) = meshes[body].node_sets[name]
            np.testing.assert_allclose(meshes[body].points[node], point, atol=1e-9)


def test_left_bodies_mirror_right_ones(meshes: dict[str, Mesh]) -> None:
    for body in ("damper", "decoupler"):
        left, right = (
            {tuple(p) for p in np.round(meshes[f"{body}_{side}"].points * mirror * 1e9).astype(np.int64).tolist()}
            for side, mirror in (("left", [1, -1, 1]), ("right", [1, 1, 1]))
        )
        assert left == right


def test_every_node_of_cone_and_groove_is_on_its_cone(rig: Rig) -> None:
    damper, decoupler = mesh_damper(rig.damper, HEX20), mesh_decoupler(rig.decoupler, HEX20)
    x, y, z = damper.points[damper.nodes("cone_blade")].T
    beyond = np.abs(y) - rig.damper.cylinder_length / 2
    np.testing.assert_allclose(np.hypot(x, z), rig.damper.radius - beyond * np.tan(radians(8.53)), atol=1e-12)
    x, y, z = decoupler.points[decoupler.nodes("groove")].T
    np.testing.assert_allclose(np.hypot(x, z), rig.decoupler.groove_radius_at(y), atol=1e-12)


def test_subdivided_meshes_are_nested(rig: Rig) -> None:
    coarse, fine = (mesh_rig(rig, choose_rig_mesh(rig, HEX8, 0.006, times)) for times in (1, 2))
    for body, cells in coarse.items():
        assert fine[body].n_cell == 8 * cells.n_cell
        there = {tuple(point) for point in np.round(fine[body].points * 1e9).astype(np.int64).tolist()}
        assert {tuple(point) for point in np.round(cells.points * 1e9).astype(np.int64).tolist()} <= there


@settings(max_examples=8, deadline=None)
@given(
    angle=st.floats(25.0, 60.0),
    thickness=st.floats(0.006, 0.018),
    neck=st.floats(0.2, 1.0),
    cell=st.floats(1.0, 1.5),
    radius=st.floats(0.005, 0.008),
    meet=st.floats(0.002, 0.010),
    element=st.sampled_from([HEX8, HEX20]),
)
def test_any_sound_decoupler_is_meshed_conformingly(
    angle: float, thickness: float, neck: float, cell: float, radius: float, meet: float, element: Element
) -> None:
    try:
        body = Decoupler(
            arm_angle=radians(angle), arm_thickness=thickness, neck_thickness=neck * thickness,
            cell_thickness=cell * thickness, groove_radius=radius, arms_meet=meet,
        )  # fmt: skip
    except GeometryError:
        assume(False)
    # Where the plate ends a hair above or below the pad, its rows of cells there are as flat as that.
    assume(min(body.plate_top - body.top, body.lip_above_axis - body.plate_bottom) > 0.001)
    cells = mesh_decoupler(body, element)
    quality = measure_cell_quality(cells)
    assert quality.scaled_jacobian.min() > SOUND_AT_WORST
    missed = CURVED["groove"][element.name] * groove_volume(body)
    assert quality.volume.sum() == pytest.approx(volume(body), rel=0, abs=missed)
    check_closed(cells)


@settings(max_examples=6, deadline=None)
@given(radius=st.floats(0.004, 0.02), middle=st.floats(0.2, 2.0), angle=st.floats(1.0, 15.0), quarter=st.integers(1, 4))
def test_any_sound_damper_is_meshed_conformingly(radius: float, middle: float, angle: float, quarter: int) -> None:
    assume(radius - 0.013 * np.tan(radians(angle)) > 0.3 * radius)
    body = Damper(radius=radius, cylinder_length=middle * radius, cone_half_angle=radians(angle))
    cells = mesh_damper(body, HEX20, DamperMesh(around_quarter=2 * quarter))
    assert measure_cell_quality(cells).scaled_jacobian.min() > 0.2
    # 8 parabolas a circle miss 9e-4 of it.
    assert measure_cell_quality(cells).volume.sum() == pytest.approx(body.volume, rel=1e-3)
    check_closed(cells)


@pytest.mark.parametrize("field", ["along_contact", "along_cylinder", "around_quarter", "across"])
def test_dampers_without_elements_are_refused_by_field(field: str) -> None:
    with pytest.raises(MeshError, match=f"dampers: {field} = 0 elements: give at least 1"):
        DamperMesh(**{field: 0})


@pytest.mark.parametrize("field", ["across_groove", "along_arm", "through_plate"])
def test_decouplers_without_elements_are_refused_by_field(field: str) -> None:
    with pytest.raises(MeshError, match=f"de-couplers: {field} = 0 elements: give at least 1"):
        DecouplerMesh(**{field: 0})


def test_counts_that_miss_a_point_are_refused() -> None:
    with pytest.raises(MeshError, match=r"dampers: around_quarter = 3 elements: give an even number"):
        DamperMesh(around_quarter=3)
    with pytest.raises(MeshError, match=r"de-couplers: across_neck = 3 elements: give an even number"):
        DecouplerMesh(across_neck=3)
    with pytest.raises(MeshError, match=r"below_groove = 4 and above_pad = 4 elements leave none for the pad: .* 8 in"):
        DecouplerMesh(below_groove=4, above_pad=4)
    with pytest.raises(MeshError, match=r'of "contact_blade" is .* um from the nearest corner node'):
        mesh_damper(Damper(), HEX8, DamperMesh(along_contact=5))
    with pytest.raises(MeshError, match=r'of "contact" is .* um from the nearest corner node'):
        mesh_decoupler(Decoupler(), HEX8, DecouplerMesh(along_contact=4))


@pytest.mark.parametrize("size", [0.0, -0.002, np.nan])
def test_a_size_that_is_none_is_refused(rig: Rig, size: float) -> None:
    with pytest.raises(MeshError, match=r"an element size of .* mm is not positive: 2\.5 mm is a usual value"):
        choose_rig_mesh(rig, HEX20, size)


def test_a_placed_mesh_is_the_own_one_moved(rig: Rig) -> None:
    place = placements(rig)["decoupler_left"]
    own, placed = mesh_decoupler(rig.decoupler, HEX8), mesh_decoupler(rig.decoupler, HEX8, placement=place)
    np.testing.assert_allclose(
        sorted(place.points(own.points).round(9).tolist()), sorted(placed.points.round(9).tolist()), atol=2e-9
    )
    stiff = replace(rig.decoupler, neck_thickness=rig.decoupler.arm_thickness)
    assert measure_cell_quality(mesh_decoupler(stiff, HEX8)).volume.sum() > measure_cell_quality(own).volume.sum()
