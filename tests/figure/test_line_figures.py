"""Figures of contact lines: each state, force and reaction in its place, and films that have their frames and move."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from fe.element import HEX8
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from figure.line_forces import LineForce, LineForces, draw_line_forces
from figure.line_states import STATES, LineStates, StateHistories, draw_line_states
from figure.reactions import Reaction, Reactions, draw_reactions
from figure.scene import off_screen
from figure.scene.caption import Layout
from figure.scene.deflection_film import save_deflection_film
from figure.scene.station_picture import StationStates
from figure.style import png
from geometry.errors import InputError, MissingSoftware, OutputError
from tests.slow import slow

DPI = 160
COLOURS = np.array([[round(255 * part) for part in to_rgb(colour)] for colour in STATES.values()])
TIME = np.arange(16) / 16


def pixels(picture: bytes) -> NDArray[np.int64]:
    with Image.open(BytesIO(picture)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int64)


def state_of(image: NDArray[np.int64]) -> NDArray[np.int64]:
    """State whose colour each pixel has; -1 for all others."""
    same = (image[:, :, None] == COLOURS).all(axis=3)
    return np.where(same.any(axis=2), same.argmax(axis=2), -1)


def test_each_cell_has_the_colour_of_its_state_at_its_place() -> None:
    states = np.array([[0, 1, 2, 1], [1, 1, 0, 0], [2, 0, 1, 2]])
    one = StateHistories(panels=[[LineStates(name="line", states=states)]], title="Title")
    result = state_of(pixels(png(draw_line_states(one))))
    # The panel alone is wider than half of the figure; the boxes of the legend are not.
    rows = np.flatnonzero((result >= 0).mean(axis=1) > 0.5)
    columns = np.flatnonzero((result[rows] >= 0).mean(axis=0) > 0.5)
    panel = result[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    height, width = panel.shape
    for station in range(3):
        for sample in range(4):
            # Cells lie around their instants: the first one at both ends of the period.
            for instant in (sample / 4 + 0.05, (sample / 4 - 0.05) % 1):
                row, column = int((1 - (station + 0.5) / 3) * height), int(instant * width)
                assert panel[row, column] == states[station, sample], (station, sample)


@pytest.mark.parametrize(
    "counts", [[1], pytest.param([2], marks=slow), pytest.param([3, 3], marks=slow), [4, 4], [4, 2]]
)
def test_one_to_eight_lines_of_any_length_are_drawn(counts: list[int]) -> None:
    def line(number: int) -> LineStates:
        return LineStates(name=f"line {number}", states=np.ones((1 + 7 * number, 3 + number), dtype=int))

    panels = [[line(number) for number in range(count)] for count in counts]
    picture = png(draw_line_states(StateHistories(panels=panels, title="Title")))
    height, width, _ = pixels(picture).shape
    assert width == round(DPI * max(7.5, 0.6 + 3.2 * max(counts)))
    assert DPI * 2 < height < DPI * 10
    # Nothing but sliding in any panel; the boxes of the legend show what else there might be.
    share = np.bincount(state_of(pixels(picture)).ravel() + 1, minlength=4)
    assert share[2] > 50 * max(share[1], share[3]) > 0


# Forces of lines.


def force(name: str = "line", label: str = "5 N", scale: float = 1.0) -> LineForce:
    normal = np.maximum(10 + 20 * scale * np.cos(2 * np.pi * TIME), 0)
    return LineForce(name=name, label=label, time=TIME, tangential=-0.5 * normal, normal=normal)


def test_the_share_of_the_friction_limit_has_no_value_where_the_line_is_separated() -> None:
    one = force()
    is_open = one.normal == 0
    assert is_open.any()
    np.testing.assert_array_equal(np.isnan(one.utilisation), is_open)
    np.testing.assert_allclose(one.utilisation[~is_open], 0.5, rtol=1e-14)
    never = LineForce(name="line", label="5 N", time=TIME, tangential=0 * TIME, normal=0 * TIME)
    assert np.isnan(never.utilisation).all()


def test_a_row_shows_both_forces_and_the_limit_and_closes_the_period() -> None:
    forces = [force(name, label, scale) for name in ("left", "right") for label, scale in (("5 N", 0.2), ("40 N", 1.0))]
    figure = draw_line_forces(
        LineForces(forces=forces, friction_coefficient={"left": 0.8, "right": 0.6}, title="Title")
    )
    assert len(figure.axes) == 2 * 3
    for row, mu in enumerate((0.8, 0.6)):
        tangential, normal, ratio = figure.axes[3 * row : 3 * row + 3]
        one = forces[2 * row + 1]
        for axes, expected in ((tangential, one.tangential), (normal, one.normal), (ratio, one.utilisation)):
            time, values = axes.lines[1].get_data()
            np.testing.assert_array_equal(values, [*expected, expected[0]])
            assert (time[0], time[-1]) == (0, 1)
        assert normal.get_ylim()[0] < 0 < 0.1 * normal.get_ylim()[1]
        dashed = ratio.lines[-1]
        assert set(dashed.get_ydata()) == {mu}
        assert dashed.is_dashed()
        assert ratio.get_ylim()[1] > mu
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["5 N", "40 N"]


def test_four_rows_are_a_page() -> None:
    names = ["a", "b", "c", "d"]
    forces = [force(name) for name in names]
    page = LineForces(forces=forces, friction_coefficient=dict.fromkeys(names, 0.5), title="Title")
    assert pixels(png(draw_line_forces(page))).shape[:2] == (round(DPI * (1.45 + 4 * 2.2)), round(DPI * 11.7))


# Reactions.


def test_a_panel_has_two_lines_a_level() -> None:
    reactions = [
        Reaction(name=side, label=f"{level} N", time=TIME, upper=level + TIME, lower=-level - TIME)
        for side in ("left", "right")
        for level in (5, 20, 40)
    ]
    figure = draw_reactions(Reactions(reactions=reactions, title="Title"))
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["left", "right"]
    for axes in figure.axes:
        assert [line.get_ydata()[0] for line in axes.lines] == [5, -5, 20, -20, 40, -40]
        assert [line.is_dashed() for line in axes.lines] == 3 * [False, True]
        assert len({line.get_color() for line in axes.lines}) == 3


def test_reactions_are_written_as_a_picture() -> None:
    one = Reaction(name="left", label="5 N", time=TIME, upper=TIME, lower=-TIME)
    assert pixels(png(draw_reactions(Reactions(reactions=[one], title="Title")))).shape == (
        round(4.6 * DPI),
        round(7.5 * DPI),
        3,
    )


# Films.

N_FRAME = 4


def beam() -> Mesh:
    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        return 0.04 * (u - 0.5), 0.01 * v, 0.25 * w

    return mesh_blocks([Block(shape=shape, counts=(2, 1, 6))], HEX8)


def swing(mesh: Mesh) -> NDArray[np.float64]:
    time = np.arange(N_FRAME) / N_FRAME
    shape = np.column_stack([0 * mesh.points[:, 0], 1e-5 * (mesh.points[:, 2] / 0.25) ** 2, 0 * mesh.points[:, 0]])
    return np.cos(2 * np.pi * time)[:, None, None] * shape


def on_the_beam(mesh: Mesh, states: NDArray[np.int64] | list[list[int]]) -> StationStates:
    """Stations in the middle of its front."""
    (nodes,) = np.nonzero((np.abs(mesh.points[:, 0]) < 1e-9) & (mesh.points[:, 1] < 1e-9) & (mesh.points[:, 2] > 0.12))
    return StationStates(node=nodes, states=np.asarray(states))


def frames(path: Path) -> list[NDArray[np.int64]]:
    with Image.open(path) as film:
        assert film.info["loop"] == 0
        result = []
        for number in range(film.n_frames):
            film.seek(number)
            result.append(np.asarray(film.convert("RGB"), dtype=np.int64))
    return result


@pytest.mark.draws
def test_a_film_has_its_frames_moves_and_shows_stations_in_the_colours_of_their_states(tmp_path: Path) -> None:
    mesh = beam()
    states = np.repeat([[0], [1], [2], [1]], 4, axis=1)
    film = frames(
        save_deflection_film(
            mesh, swing(mesh), tmp_path / "a.gif", title="Beam", subtitle="1 Hz", stations=on_the_beam(mesh, states)
        )
    )
    assert len(film) == N_FRAME
    height, width, _ = film[0].shape
    assert width > height * 0.6
    # Half a period apart the beam is on opposite sides.
    assert (np.abs(film[0] - film[2]).max(axis=2) > 40).mean() > 0.01
    # The legend shows all three states, the dots but one.
    counts = [np.bincount(state_of(frame).ravel() + 1, minlength=4)[1:] for frame in film]
    for state in (0, 1, 2):
        shown = [count[state] for count in counts]
        expected = [row[0] == state for row in states]
        least = min(count for count, there in zip(shown, expected, strict=True) if there)
        most = max(count for count, there in zip(shown, expected, strict=True) if not there)
        # Each of the four dots is 8.5 pixels wide, and its rim eats some.
        assert least > most + 4 * 20
    assert tuple(film[0][0, 0]) == (255, 255, 255)


@slow
@pytest.mark.draws
def test_a_film_without_stations_is_that_of_the_bodies_alone(tmp_path: Path) -> None:
    mesh = beam()
    film = frames(save_deflection_film(mesh, swing(mesh), tmp_path / "a.gif", title="Beam", amplitude=0.02))
    height, width, _ = film[0].shape
    assert (len(film), height) == (N_FRAME, Layout(width=width, height=900).height)
    assert width < height
    # A quarter of a period after both ends it is where it rests; no words change.
    np.testing.assert_array_equal(film[1], film[3])
    with pytest.raises(OutputError, match=r"a\.gif cannot be written \(No such file"):
        save_deflection_film(mesh, swing(mesh), tmp_path / "no" / "a.gif", title="Beam")


def test_where_nothing_can_be_drawn_a_film_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def cannot_draw() -> None:
        raise MissingSoftware("this machine draws nothing")

    monkeypatch.setattr(off_screen, "require_egl", cannot_draw)
    mesh = beam()
    with pytest.raises(MissingSoftware, match="this machine draws nothing"):
        save_deflection_film(mesh, swing(mesh), tmp_path / "a.gif", title="Beam")


# Bad input.


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"displacement": np.zeros((4, 3, 3))}, r"has the shape \(4, 3, 3\), but the mesh has 42 nodes"),
        ({"displacement": np.zeros((1, 42, 3))}, r"has the shape \(1, 42, 3\).* at least 2 frames"),
        ({"displacement": np.full((4, 42, 3), np.inf)}, "504 values that are not finite"),
        ({"amplitude": 0.0}, "amplitude = 0 m must be positive"),
        ({"path": "a.mp4"}, r'suffix "\.mp4": use \.gif'),
        (
            {"stations": StationStates(node=np.array([1]), states=np.zeros((3, 1), dtype=int))},
            "states are of 3 frames, but displacement is of 4",
        ),
        (
            {"stations": StationStates(node=np.array([1, 42]), states=np.zeros((4, 2), dtype=int))},
            "a station is at node 42: the mesh has nodes 0 to 41",
        ),
    ],
)
def test_a_film_of_what_does_not_match_is_refused(change: dict[str, object], message: str) -> None:
    mesh = beam()
    assert mesh.n_node == 42
    arguments = {"displacement": swing(mesh), "path": "a.gif", "title": "Beam", **change}
    with pytest.raises(InputError, match=message):
        save_deflection_film(mesh, **arguments)


def test_data_of_wrong_shapes_cannot_be_made() -> None:
    with pytest.raises(InputError, match=r'states of "line" have the shape \(3,\): give \(station, sample\)'):
        LineStates(name="line", states=np.zeros(3, dtype=int))
    with pytest.raises(InputError, match=r'states of "line" have the value 3: give 0 stuck'):
        LineStates(name="line", states=np.array([[0, 3]]))
    with pytest.raises(InputError, match=r"states have the shape \(4, 3\): give \(frame, 2\)"):
        StationStates(node=np.array([1, 2]), states=np.zeros((4, 3), dtype=int))
    with pytest.raises(InputError, match=r"node has the shape \(0,\)"):
        StationStates(node=np.array([], dtype=int), states=np.zeros((4, 0), dtype=int))
    with pytest.raises(InputError, match=r'normal of "line" has the shape \(3,\): give \(16,\)'):
        LineForce(name="line", label="", time=TIME, tangential=TIME, normal=np.zeros(3))
    with pytest.raises(InputError, match=r'lower of "left" has the shape \(2,\): give \(16,\)'):
        Reaction(name="left", label="", time=TIME, upper=TIME, lower=np.zeros(2))


def test_figures_of_nothing_or_too_much_are_refused() -> None:
    with pytest.raises(InputError, match=r"contain no line"):
        draw_line_states(StateHistories(panels=[[]], title="Title"))
    many = [force(name) for name in "abcde"]
    with pytest.raises(InputError, match=r"forces of 5 lines .* give 1 to 4"):
        draw_line_forces(LineForces(forces=many, friction_coefficient=dict.fromkeys("abcde", 0.5), title="Title"))
    with pytest.raises(InputError, match='no value for "b"'):
        draw_line_forces(LineForces(forces=many[:2], friction_coefficient={"a": 0.5}, title="Title"))
    with pytest.raises(InputError, match="0 de-couplers"):
        draw_reactions(Reactions(reactions=[], title="Title"))
