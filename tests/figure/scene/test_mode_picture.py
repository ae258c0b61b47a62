"""Pictures of modes: their size, a body in them, its deflection to be seen, and no crash where none can be drawn."""

import ctypes
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fe.element import ELEMENTS, HEX8, HEX20, TET10, Element
from fe.face_integral import find_outer_faces
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from figure.scene.mode_picture import ModeColour, mode_animation, mode_picture
from figure.scene.off_screen import require_egl
from figure.scene.skin import make_skin
from geometry.errors import InputError, MissingSoftware, OutputError

EVERY = pytest.mark.parametrize("element", list(ELEMENTS.values()), ids=lambda element: element.name)


def beam(element: Element) -> Mesh:
    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        return 0.04 * u, 0.01 * v, 0.25 * w

    return mesh_blocks([Block(shape=shape, counts=(2, 1, 6))], element)


def bending(mesh: Mesh) -> NDArray[np.float64]:
    """The first bending mode of a clamped beam, roughly: y grows with the square of the height."""
    z = mesh.points[:, 2] / np.ptp(mesh.points[:, 2])
    return np.column_stack([0 * z, z**2, -z * (mesh.points[:, 1] - 0.005) / 0.25])


def pixels(path: Path) -> NDArray[np.int64]:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int64)


# The skin, which needs no window.


@EVERY
def test_a_box_has_its_six_sides_and_twelve_edges(element: Element) -> None:
    mesh = beam(element)
    skin = make_skin(mesh)
    counts = (2, 1, 6)
    sides = 2 * (counts[0] * counts[1] + counts[1] * counts[2] + counts[0] * counts[2])
    # Tetrahedra cut each side of a brick into two triangles, wedges those that they stand on.
    cut = {8: 0, 6: 2 * counts[0] * counts[1], 4: sides}[element.n_corner]
    faces = find_outer_faces(mesh)
    assert len(faces) == sides + cut
    # Edges on a closed surface: half of those of all faces; features: four of each length.
    assert len(skin.edges) == sum(len(element.corner_faces[local]) for local in faces[:, 1]) / 2
    assert skin.is_feature.sum() == 4 * sum(counts)


@EVERY
def test_a_linear_field_is_sampled_exactly_and_normals_point_outwards(element: Element) -> None:
    mesh = beam(element)
    skin = make_skin(mesh)
    points = skin.sample @ mesh.points
    # A sum of at most eight products near 0.1.
    np.testing.assert_allclose(skin.sample @ (mesh.points @ [1, 2, 3]), points @ [1, 2, 3], atol=1e-15)
    normals = skin.normals(mesh.points)
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1, atol=1e-12)
    centre = mesh.points.mean(axis=0)
    assert ((points - centre) * normals).sum(axis=1).min() > 0


@pytest.mark.parametrize("element", [HEX20, TET10], ids=lambda element: element.name)
def test_quadratic_faces_follow_a_circle_closely(element: Element) -> None:
    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        angle = np.pi / 2 * u
        return (1 + v) * np.cos(angle), (1 + v) * np.sin(angle), w

    mesh = mesh_blocks([Block(shape=shape, counts=(2, 1, 1))], element)
    skin = make_skin(mesh)
    radius = np.hypot(*(skin.sample @ mesh.points).T[:2])[np.unique(skin.edges)]
    outer = radius[np.abs(radius - 2) < 0.2]
    # The parabola through both ends and the middle of an arc of 45 degrees, sampled at its quarter points.
    half = np.pi / 8
    quarter_point = 2 * np.hypot(0.75 + 0.25 * np.cos(half), 0.5 * np.sin(half))
    assert np.abs(outer - 2).max() == pytest.approx(2 - quarter_point, rel=1e-9)


# The pictures.


@pytest.mark.draws
@EVERY
def test_a_picture_has_its_size_a_body_and_colours(element: Element, tmp_path: Path) -> None:
    mesh = beam(element)
    path = mode_picture(
        mesh, bending(mesh), tmp_path / "mode.png", frequency=122.25, title="Mode 1", window_size=(400, 700)
    )
    image = pixels(path)
    assert image.shape == (700, 400, 3)
    body = image[100:640, :280]
    coloured = np.ptp(body, axis=2) > 30
    # A beam a tenth as wide as high, seen in a place a third as wide as high: some of it, not most of it.
    assert 0.05 < coloured.mean() < 0.6
    # Both ends of the colour map are on the body: yellow at the tip, violet at the foot.
    assert (body[coloured] @ [1, 1, -2]).max() > 200
    assert (body[coloured] @ [1, -2, 1]).max() > 50
    # It fills the height of its place.
    rows = np.flatnonzero(coloured.any(axis=1))
    assert np.ptp(rows) > 0.85 * len(body)


@pytest.mark.draws
def test_the_frame_stays_free_of_the_body(tmp_path: Path) -> None:
    mesh = beam(HEX8)
    image = pixels(mode_picture(mesh, bending(mesh), tmp_path / "mode.png", frequency=1.0, window_size=(400, 700)))
    for strip in (image[:8], image[-8:], image[:, :8], image[:, -8:]):
        assert strip.min() == 255


@pytest.mark.draws
def test_the_deflection_changes_the_picture_and_its_scale_does_not(tmp_path: Path) -> None:
    mesh = beam(HEX20)
    look = {"frequency": 122.25, "window_size": (400, 700)}

    def drawn(name: str, displacement: NDArray[np.float64], **more: float) -> NDArray[np.int64]:
        return pixels(mode_picture(mesh, displacement, tmp_path / f"{name}.png", **look, **more))

    bent = drawn("bent", bending(mesh))
    np.testing.assert_array_equal(drawn("larger", 1e3 * bending(mesh)), bent)
    assert (np.abs(drawn("other", bending(mesh)[:, [1, 0, 2]]) - bent).max(axis=2) > 40).mean() > 0.01
    assert (np.abs(drawn("double", bending(mesh), amplitude=0.05) - bent).max(axis=2) > 40).mean() > 0.01


@pytest.mark.draws
def test_stress_is_drawn_with_its_unit_in_its_own_colours(tmp_path: Path) -> None:
    mesh = beam(HEX20)
    stress = 80 * (1 - mesh.points[:, 2] / 0.25)
    look = {"frequency": 122.25, "window_size": (400, 700)}
    with_unit, without = (
        pixels(
            mode_picture(
                mesh,
                bending(mesh),
                tmp_path / f"{unit}.png",
                colour=ModeColour(field="von_mises", values=stress, unit=unit),
                **look,
            )
        )
        for unit in ("MPa", None)
    )
    left_of_bar = slice(0, 280)
    np.testing.assert_array_equal(with_unit[100:640, left_of_bar], without[100:640, left_of_bar])
    assert (with_unit != without).any()


@pytest.mark.draws
def test_an_animation_has_its_frames_and_moves(tmp_path: Path) -> None:
    mesh = beam(HEX8)
    path = mode_animation(
        mesh, bending(mesh), tmp_path / "mode.gif", frequency=122.25, window_size=(300, 500), n_frame=6
    )
    with Image.open(path) as film:
        assert film.n_frames == 6
        assert film.size == (300, 500)
        assert film.info["loop"] == 0
        frames = []
        for number in range(6):
            film.seek(number)
            frames.append(np.asarray(film.convert("RGB"), dtype=np.int64))
    # Half a period apart the body is on opposite sides; after the same time before and after it, in the same place.
    assert (np.abs(frames[0] - frames[3]).max(axis=2) > 40).mean() > 0.01
    np.testing.assert_array_equal(frames[1], frames[5])
    assert tuple(frames[0][0, 0]) == (255, 255, 255)


# Bad input and missing software.


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"displacement": np.zeros((3, 3))}, r"displacement has the shape \(3, 3\), but the mesh has"),
        ({"displacement": np.full((127, 3), np.nan)}, "381 values that are not finite"),
        ({"colour": ModeColour(values=np.zeros(5))}, r"values have the shape \(5,\): give 127"),
        ({"colour": ModeColour(field="strain")}, 'field = "strain" is unknown: use one of displacement, von_mises'),
        ({"colour": ModeColour(field="von_mises")}, "cannot be computed from a displacement alone"),
        ({"amplitude": -1.0}, "amplitude = -1 m must be positive"),
        ({"path": "mode.jpeg"}, r'suffix "\.jpeg": use \.png'),
        ({"window_size": (100, 100)}, r"window_size = \(100, 100\) pixels is too small"),
    ],
)
def test_bad_input_is_answered_with_its_value(change: dict[str, object], message: str) -> None:
    mesh = beam(HEX20)
    arguments = {"displacement": bending(mesh), "path": "mode.png", "frequency": 1.0, **change}
    assert mesh.n_node == 127
    with pytest.raises(InputError, match=message):
        mode_picture(mesh, **arguments)


@pytest.mark.draws
def test_a_folder_that_does_not_exist_is_named(tmp_path: Path) -> None:
    mesh = beam(HEX8)
    with pytest.raises(OutputError, match=r"mode\.png cannot be written \(No such file"):
        mode_picture(mesh, bending(mesh), tmp_path / "no" / "mode.png", frequency=1.0, window_size=(300, 300))


def test_one_frame_is_no_film() -> None:
    mesh = beam(HEX8)
    with pytest.raises(InputError, match="n_frame = 1"):
        mode_animation(mesh, bending(mesh), "mode.gif", frequency=1.0, n_frame=1)


def test_a_film_without_its_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = beam(HEX8)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingSoftware, match=r"pip install imageio-ffmpeg`, or write a \.gif"):
        mode_animation(mesh, bending(mesh), "mode.mp4", frequency=1.0)


def accept(*arguments: object) -> None:
    return None


def no_device(egl: object) -> int:
    return 0


def test_without_egl_the_remedy_comes_before_any_import(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = ctypes.CDLL

    def no_egl(name: str, *rest: object) -> ctypes.CDLL:
        if "EGL" in str(name):
            raise OSError(f"{name}: cannot open shared object file")
        return whole(name, *rest)

    monkeypatch.setattr("figure.scene.off_screen.require_system_libraries", accept)
    monkeypatch.setattr(ctypes, "CDLL", no_egl)
    with pytest.raises(MissingSoftware, match=r"libEGL\.so\.1: install it with `apt-get .* libegl1"):
        require_egl()


def test_egl_without_a_driver_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("figure.scene.off_screen.require_system_libraries", accept)
    monkeypatch.setattr(ctypes, "CDLL", accept)
    monkeypatch.setattr("figure.scene.off_screen._count_devices", no_device)
    with pytest.raises(MissingSoftware, match="need a driver for EGL"):
        require_egl()
