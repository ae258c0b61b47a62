"""The rig in tetrahedra: mirror images, places of stations, and the damper beside the one of bricks."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from fe.element import TET10
from fe.face_integral import integrate_areas, integrate_volume
from fe.material import STEEL
from fe.mesh_quality import measure_cell_quality
from fe.station_coordinates import StationCoordinates, make_station_coordinates
from geometry.errors import InputError
from geometry.rig import Rig, mating_pairs, named_points
from pipeline.progress import SilentProgress
from pipeline.store import Store
from study.kind.blade.table import MeshTable
from study.kind.rig.model import LINES, RigModel, body_tetrahedra, mesh_in_tetrahedra, mirror_tetrahedra
from study.kind.rig.reduction import reduced_body
from study.kind.rig.table import RigMeshTable
from tests.fe.surface import area_vectors
from tests.slow import slow

needs_tetwild = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="pytetwild is not installed: pip install stickslip[tets]"
)
BODY = "damper_right"


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(rig=Rig(), material=STEEL, element="hex20", size=0.005, n_mode=12)


def cut(model: RigModel) -> StationCoordinates:
    """The damper in tetrahedra cut from bricks, its stations taken as if nodes knew nothing of them."""
    mesh = replace(model, element="tet10").meshes()[BODY]
    stations = {name: mesh.points[mesh.node_sets[name]] for name in LINES["damper"]}
    return make_station_coordinates(replace(mesh, node_sets={}), stations, LINES["damper"])


def test_a_mirror_image_has_the_reflected_faces_around_the_same_volume(model: RigModel) -> None:
    place = cut(model)
    image = mirror_tetrahedra(place)
    np.testing.assert_array_equal(image.mesh.points, place.mesh.points * [1, -1, 1])
    assert measure_cell_quality(image.mesh).determinant_ratio.min() == pytest.approx(
        measure_cell_quality(place.mesh).determinant_ratio.min(), rel=1e-9
    )
    assert integrate_volume(image.mesh) == pytest.approx(integrate_volume(place.mesh), rel=1e-12)
    for name, faces in place.mesh.face_sets.items():
        own, reflected = (area_vectors(item.mesh, item.mesh.face_sets[name])[0] for item in (place, image))
        np.testing.assert_allclose(reflected, own * [1, -1, 1], atol=1e-15)
        np.testing.assert_array_equal(image.mesh.nodes(name), place.mesh.nodes(name))
        assert len(faces)
    np.testing.assert_allclose(image.places, place.places * [1, -1, 1], atol=1e-15)


def test_bricks_and_meshes_that_are_there_stay_as_they_are(model: RigModel) -> None:
    store, progress = Store(None), SilentProgress()
    assert mesh_in_tetrahedra(model, store, progress) is model
    made = replace(model, element="tet10", tetrahedra={BODY: cut(model)})
    assert mesh_in_tetrahedra(made, store, progress) is made


def test_without_pytetwild_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fe.mesher.ftetwild.MODULE", "no_such_module")
    with pytest.raises(
        InputError,
        match=r'pytetwild, which is not installed: sh install.sh, in a checkout pip install -e "\.\[tets\]", or mesh',
    ):
        body_tetrahedra(Rig(), BODY, 0.005)


@slow
@needs_tetwild
def test_a_damper_by_tetwild_has_its_stations_and_the_frequencies_of_bricks(model: RigModel) -> None:
    place = body_tetrahedra(model.rig, BODY, 0.005)
    mesh = place.mesh
    assert set(mesh.cells) == {TET10.cell_type}
    pairs = [pair for pair in mating_pairs(model.rig).values() if pair.damper == BODY]
    expected = {pair.damper_line.name: pair.damper_line.stations for pair in pairs}
    expected |= {name: point[None] for name, point in named_points(model.rig)[BODY].items()}
    for name, at in expected.items():
        # A cone's facets of parabolas miss it by some um.
        np.testing.assert_allclose(place.places[mesh.node_sets[name]], at, atol=2e-5)
    assert integrate_areas(mesh, mesh.face_sets["cylinder"]).sum() > 0
    tets, bricks = (
        reduced_body(item, BODY) for item in (replace(model, element="tet10", tetrahedra={BODY: place}), model)
    )
    assert set(tets.rom.boundary_sets) == set(bricks.rom.boundary_sets)
    own, other = (item.rom.modes(10).frequency for item in (tets, bricks))
    # A rigid body, and then elastic modes of meshes of two or three cells across.
    np.testing.assert_allclose(own[6:], other[6:], rtol=1e-2)
    stiff = tets.rom.stiffness
    held = np.abs(stiff @ rigid(place, tets.rom.boundary_node, tets.rom.boundary_direction, tets.rom.n_dof)).max()
    assert held < 1e-7 * np.abs(stiff).max()


def rigid(place: StationCoordinates, node: np.ndarray, direction: np.ndarray, n: int) -> np.ndarray:
    """A rotation about x, in reduced coordinates: stations turn where they are, not where their pivots are."""
    motion = np.zeros(n)
    motion[: len(node)] = np.cross([1.0, 0, 0], place.places[node])[np.arange(len(node)), direction]
    return motion


def test_the_cases_of_blades_and_rigs_take_tetrahedra() -> None:
    assert MeshTable(element="tet10", length_ratio=2.0, length_cap="8 mm").element == TET10.name
    assert RigMeshTable(element="tet10", size="4 mm").element == "tet10"
