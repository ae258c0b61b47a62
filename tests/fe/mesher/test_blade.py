"""The rig's blade as cells: closed, conforming, of the right volume and areas, with contact where the CAD has it."""

from math import pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.mesh_rule import MeshRule
from geometry.blade import Blade, contact_lines
from geometry.errors import GeometryError
from tests.fe.surface import area_vectors, boundary, check_closed

FEW = PadMesh(across_groove=2, across_lip=1, above_groove=2, band=1)


def rule(element: Element = HEX20, n: int = 1, ratio: float = 2.4, cap: float = 0.02) -> MeshRule:
    return MeshRule(element=element, through_thickness=n, length_ratio=ratio, length_cap=cap)


def mesh(element: Element = HEX20, blade: Blade | None = None, pads: PadMesh | None = None, n: int = 1) -> Mesh:
    return mesh_blade(blade or Blade(), rule(element, n), pads)


class Theory:
    """Volumes and areas of the blade from its dimensions, by integrals along y where the groove widens [m]."""

    def __init__(self, blade: Blade) -> None:
        b = self.blade = blade
        self.depth = b.pad_face - b.thickness / 2
        self.height = b.pad_top - b.pad_bottom
        self.section = b.flat_width * b.thickness + (b.chord - b.flat_width) * (b.thickness + b.edge_thickness) / 2
        root = b.root_chord * b.root_thickness * b.root_height
        pad = b.flat_width * self.height * self.depth - self.along(self.segment)
        self.volume = root + self.section * b.length + 2 * pad

    def along(self, what: object) -> float:
        assert callable(what)
        y0, y1 = self.blade.thickness / 2, self.blade.pad_face
        return float(quad(lambda y: what(float(self.blade.groove_radius_at(np.asarray(y)))), y0, y1, epsabs=1e-18)[0])

    def segment(self, radius: float) -> float:
        """Part of the groove's circle that cuts into the pad: above its lower face."""
        d = self.blade.lip_above_axis
        return float(radius**2 * np.arccos(d / radius) - d * np.sqrt(radius**2 - d**2))

    def arc(self, radius: float) -> float:
        return float(2 * radius * np.arccos(self.blade.lip_above_axis / radius))

    def mouth(self, radius: float) -> float:
        return float(2 * np.sqrt(radius**2 - self.blade.lip_above_axis**2))

    @property
    def areas(self) -> dict[str, float]:
        b = self.blade
        groove = self.along(self.arc) / np.cos(b.cone_half_angle)
        pad = b.flat_width * self.height - self.segment(b.wide_groove_radius)
        return {
            "clamp": 2 * b.root_chord * b.root_height,
            "root_bottom": b.root_chord * b.root_thickness,
            "tip": self.section,
            "groove_positive": groove,
            "groove_negative": groove,
            "pad_positive": pad,
            "pad_negative": pad,
        }

    @property
    def surface(self) -> float:
        b, areas = self.blade, self.areas
        root = 2 * (b.root_chord + b.root_thickness) * b.root_height + 2 * areas["root_bottom"] - self.section
        bevel = np.hypot((b.chord - b.flat_width) / 2, (b.thickness - b.edge_thickness) / 2)
        footprint = b.flat_width * self.height - self.segment(b.narrow_groove_radius)
        blade = (2 * b.flat_width + 2 * b.edge_thickness + 4 * bevel) * b.length - 2 * footprint
        lips = b.flat_width * self.depth - self.along(self.mouth)
        pad = areas["pad_positive"] + 2 * self.depth * self.height + b.flat_width * self.depth + lips
        return float(root + blade + self.section + 2 * (pad + areas["groove_positive"]))


# Six parabolas across the groove miss 6e-5 of what it cuts out of the pads (0.7 % of the volume), six chords 4 %.
CURVED = {"hex8": 5e-4, "hex20": 1e-6, "tet10": 1e-6}


def test_volume_and_surface_are_those_of_the_dimensions(element: Element) -> None:
    theory, cells = Theory(Blade()), mesh(element)
    assert measure_cell_quality(cells).volume.sum() == pytest.approx(theory.volume, rel=CURVED[element.name])
    _, areas = area_vectors(cells, boundary(cells))
    # A crack between blocks would show as faces on both of its sides.
    assert areas.sum() == pytest.approx(theory.surface, rel=CURVED[element.name])


def test_faces_have_their_names_and_areas(element: Element) -> None:
    cells = mesh(element)
    expected = Theory(Blade()).areas
    assert set(cells.face_sets) == set(expected)
    outside = {tuple(face) for face in boundary(cells).tolist()}
    for name, area in expected.items():
        faces = cells.face_sets[name]
        assert {tuple(face) for face in faces.tolist()} <= outside, name
        curved = name.startswith(("groove", "pad"))
        # Six chords miss 0.9 % of a face that the groove bounds, six parabolas 2e-5.
        tolerance = 1e-12 if not curved else {"hex8": 0.01, "hex20": 1e-4, "tet10": 1e-4}[element.name]
        assert area_vectors(cells, faces)[1].sum() == pytest.approx(area, rel=tolerance), name


def test_the_surface_is_closed_and_without_holes(element: Element) -> None:
    check_closed(mesh(element))


def test_cells_keep_their_shape(element: Element) -> None:
    for n in (1, 2, 4):
        quality = measure_cell_quality(mesh(element, n=n))
        # A mapped mesh of sound blocks: 0.2 is where solvers start to warn, 0.5 was measured. Tetrahedra cut from long
        # bricks are as long, which is a fault to this measure of them; but none is bent much.
        assert quality.scaled_jacobian.min() > (0.5 if element.n_corner == 8 else 0.02)
        assert quality.determinant_ratio.min() > 0.4


def test_contact_stations_are_corner_nodes_in_the_order_of_the_line(element: Element) -> None:
    blade, cells = Blade(), mesh(element)
    for name, line in contact_lines(blade).items():
        nodes = cells.node_sets[name]
        np.testing.assert_allclose(cells.points[nodes], line.stations, atol=1e-12)
        assert np.isin(nodes, cells.corner_nodes()).all()
        assert np.isin(nodes, cells.nodes(name.replace("contact", "groove"))).all()


def test_every_node_of_the_groove_is_on_the_cone_midside_nodes_too(element: Element) -> None:
    blade, cells = Blade(), mesh(element)
    for side in ("positive", "negative"):
        x, y, z = cells.points[cells.nodes(f"groove_{side}")].T
        radius = np.hypot(x, z - blade.groove_axis)
        # A picometre: round-off of coordinates near a tenth of a metre is 1e-17.
        np.testing.assert_allclose(radius, blade.groove_radius_at(y), atol=1e-12)
        assert (np.sign(y) == (1 if side == "positive" else -1)).all()


def test_clamp_tip_and_pads_lie_where_they_should(element: Element) -> None:
    blade, cells = Blade(), mesh(element)
    clamp = cells.points[cells.nodes("clamp")]
    np.testing.assert_allclose(np.abs(clamp[:, 1]), blade.root_thickness / 2, atol=1e-15)
    assert clamp[:, 2].max() <= 1e-15
    np.testing.assert_allclose(cells.points[cells.nodes("tip"), 2], blade.length, atol=1e-15)
    np.testing.assert_allclose(cells.points[cells.nodes("pad_negative"), 1], -blade.pad_face, atol=1e-15)
    np.testing.assert_allclose(
        cells.points[cells.node_sets["response"]], [[0, blade.thickness / 2, blade.length]], atol=1e-15
    )
    (excitation,) = cells.points[cells.node_sets["excitation"]]
    np.testing.assert_allclose(excitation[:2], [0, blade.thickness / 2], atol=1e-15)
    assert abs(excitation[2] - blade.excitation_height) <= 0.02 / 2  # half a cell


@pytest.mark.parametrize("height", [0.013, 0.0171, 0.031, 0.045])
@pytest.mark.parametrize("subdivisions", [1, 2])
def test_a_layer_of_nodes_is_moved_to_a_height_and_no_cell_is_added(height: float, subdivisions: int) -> None:
    blade = Blade(excitation_height=height)
    coarse = MeshRule(element=HEX8, through_thickness=1, length_ratio=9, length_cap=0.008, subdivisions=subdivisions)
    cells, as_they_fall = (mesh_blade(blade, coarse, FEW, layer) for layer in (height, None))
    (point,) = cells.points[cells.node_sets["excitation"]]
    np.testing.assert_allclose(point, [0, blade.thickness / 2, height], atol=1e-15)
    np.testing.assert_array_equal(cells.cells["hexahedron"], as_they_fall.cells["hexahedron"])
    # Nodes stay in their columns and beside their neighbours: half of a cell of at most 8 mm at the most.
    moved = np.abs(cells.points - as_they_fall.points).max(axis=0)
    assert moved[1] < 1e-15
    assert 0 < moved[2] <= 0.004
    assert measure_cell_quality(cells).scaled_jacobian.min() > 0.5


@pytest.mark.parametrize("height", [0.001, 0.2])
def test_no_layer_is_moved_to_a_height_beside_the_root_or_above_the_pads(height: float) -> None:
    cells, as_they_fall = (mesh_blade(Blade(), rule(HEX8, ratio=9, cap=0.05), FEW, layer) for layer in (height, None))
    np.testing.assert_array_equal(cells.points, as_they_fall.points)


def test_the_mesh_is_its_own_mirror_image_in_x_and_y() -> None:
    cells = mesh(HEX20)
    there = {tuple(point) for point in np.round(cells.points * 1e9).astype(np.int64).tolist()}
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        assert {tuple(p) for p in np.round(cells.points * mirror * 1e9).astype(np.int64).tolist()} == there


def test_subdivided_meshes_are_nested() -> None:
    coarse = mesh_blade(Blade(), rule(HEX8, ratio=9, cap=0.05), PadMesh(across_groove=2, across_lip=1, above_groove=1))
    fine_rule = MeshRule(element=HEX8, through_thickness=1, length_ratio=9, length_cap=0.05, subdivisions=2)
    fine = mesh_blade(Blade(), fine_rule, PadMesh(across_groove=2, across_lip=1, above_groove=1))
    assert fine.n_cell == 8 * coarse.n_cell
    there = {tuple(point) for point in np.round(fine.points * 1e9).astype(np.int64).tolist()}
    assert {tuple(point) for point in np.round(coarse.points * 1e9).astype(np.int64).tolist()} <= there


@settings(max_examples=25, deadline=None)
@given(
    scale=st.tuples(*[st.floats(0.8, 1.25)] * 6),
    angle=st.floats(2, 14),
    n=st.integers(1, 3),
    ratio=st.floats(0.5, 8),
    element=st.sampled_from([HEX8, HEX20]),
)
def test_any_sound_blade_is_meshed_conformingly_and_well(
    scale: tuple[float, ...], angle: float, n: int, ratio: float, element: Element
) -> None:
    names = ("length", "thickness", "flat_width", "contact_height", "groove_radius", "pad_height_above_groove")
    start = Blade()
    try:
        blade = Blade(
            **{name: factor * getattr(start, name) for name, factor in zip(names, scale, strict=True)},
            cone_half_angle=angle * pi / 180,
        )
    except GeometryError:
        assume(False)
    cells = mesh_blade(blade, rule(element, n, max(ratio, n), 0.03), FEW)
    assert measure_cell_quality(cells).scaled_jacobian.min() > 0.2
    theory = Theory(blade)
    _, areas = area_vectors(cells, boundary(cells))
    # Two cells across the groove: chords miss 30 % of what it cuts out, parabolas half a per cent, of 1 % or so.
    tolerance = {"hex8": 1e-2, "hex20": 2e-4}[element.name]
    assert measure_cell_quality(cells).volume.sum() == pytest.approx(theory.volume, rel=tolerance)
    assert areas.sum() == pytest.approx(theory.surface, rel=tolerance)


@pytest.mark.parametrize("name", ["along_contact", "across_groove", "across_lip", "above_groove", "band"])
def test_no_elements_in_the_pads_are_refused_by_field(name: str) -> None:
    with pytest.raises(MeshError, match=f"pads: {name} = 0 elements: give at least 1"):
        PadMesh(**{name: 0})


def test_an_odd_number_across_the_groove_is_refused() -> None:
    with pytest.raises(MeshError, match="across_groove = 5 elements: give an even number"):
        PadMesh(across_groove=5)


def test_a_contact_line_whose_stations_fall_between_nodes_is_refused() -> None:
    with pytest.raises(
        MeshError, match=r'of "contact_positive" is .* um from the nearest corner node: give the contact'
    ):
        mesh(pads=PadMesh(along_contact=4))


@pytest.mark.parametrize("height", [0.2, -0.001, 0.0])
def test_a_band_that_does_not_fit_is_refused(height: float) -> None:
    with pytest.raises(MeshError, match=rf"band_height = {height * 1e3:g} mm does not fit under the pad"):
        mesh(pads=PadMesh(band_height=height))


def test_a_root_block_as_thin_as_the_blade_is_refused() -> None:
    with pytest.raises(MeshError, match=r"root_thickness = 10.04 mm must exceed .* blade, 10.04 mm"):
        mesh(blade=Blade(thickness=0.01004, root_thickness=0.01004))


@pytest.mark.parametrize(
    ("change", "columns"), [({"flat_width": 0.022, "chord": 0.022}, "no bevels"), ({"root_chord": 0.04}, "no overhang")]
)
def test_blades_without_bevels_or_overhang_have_no_cells_for_them(change: dict[str, float], columns: str) -> None:
    base = {"chord": 0.04, "root_chord": 0.06} | change
    blade = Blade(**base)
    cells = mesh(HEX20, blade)
    assert measure_cell_quality(cells).volume.sum() == pytest.approx(Theory(blade).volume, rel=2e-6)
