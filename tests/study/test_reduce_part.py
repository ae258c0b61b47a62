"""`stickslip reduce` of a user's own part: a bar as mesh and as STEP file, against its own full model."""

import csv
import importlib.util
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.calculix_run import find_ccx, run_frequency
from fe.dense_modes import compute_dense_modes
from fe.element import HEX8, HEX20, TET10
from fe.face_integral import integrate_areas
from fe.file.mesh_file import read_mesh, write_mesh
from fe.host_face import find_station_weights
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes
from reduction.file.rom_hdf5 import load_rom
from reduction.stuck import stuck_stiffness
from study.case.setup import read_case
from study.cli import main
from study.kind.part.reduce import _draw_pictures as drawn

needs_tetwild = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="pytetwild is not installed: pip install stickslip[tets]"
)
MATERIAL = f"""\
[structure.material]
young = "{STEEL.young:g} Pa"
poisson = {STEEL.poisson}
density = "{STEEL.density:g} kg/m^3"
"""
REST = f"""
{MATERIAL}
[[structure.support]]
on = ["foot"]
[[structure.point]]
name = "tip"
at = ["7 mm", "3 mm", "60 mm"]
[[structure.line]]
name = "rub"
on = "top"
from = ["2 mm", "5 mm", "60 mm"]
to = ["18 mm", "5 mm", "60 mm"]
stations = 3
[[structure.line]]
name = "rim"
edge = ["top", "side"]
stations = 4
[structure.reduction]
modes = 12
[structure.damping]
ratio = "1 %"
"""
MESH_CASE = f"""\
schema = 2
title = "Bar"
[structure]
kind = "part"
file = "bar.inp"
length_unit = "m"
{REST}
[[structure.boundary]]
name = "middle"
on = "belt"
directions = ["x", "y"]
"""
STEP_CASE = f"""\
schema = 2
title = "Bar"
[structure]
kind = "part"
file = "bar.step"
[structure.mesh]
size = "6 mm"
[[structure.face]]
name = "foot"
normal = [0, 0, -1]
[[structure.face]]
name = "top"
at = ["2 mm", "5 mm", "60 mm"]
[[structure.face]]
name = "side"
normal = [0, -1, 0]
{REST}
"""


def stickslip(*words: str) -> int:
    return main([*words, "--quiet"])


def bar(element: str = "tet10") -> Mesh:
    """20 x 10 x 60 mm in blocks of 5 mm, with faces and a belt of four corner nodes."""
    kind = {item.name: item for item in (HEX8, HEX20, TET10)}[element]
    block = Block(
        shape=lambda u, v, w: (0.02 * u, 0.01 * v, 0.06 * w),
        counts=(4, 2, 12),
        faces={"w0": "foot", "w1": "top", "v0": "side"},
    )
    mesh = mesh_blocks([block], kind)
    corners = [[0, 0, 0.03], [0.02, 0, 0.03], [0.02, 0.01, 0.03], [0, 0.01, 0.03]]
    belt = [int(np.linalg.norm(mesh.points - corner, axis=1).argmin()) for corner in np.array(corners)]
    return Mesh(points=mesh.points, cells=mesh.cells, face_sets=mesh.face_sets, node_sets={"belt": np.array(belt)})


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the case and its mesh; no pictures, which take longer than all the rest."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("study.kind.part.reduce._draw_pictures", lambda *_: [])
    write_mesh(bar(), tmp_path / "bar.inp")
    (tmp_path / "bar.toml").write_text(MESH_CASE)
    return tmp_path


def document(capfd: pytest.CaptureFixture[str], *words: str) -> dict:
    capfd.readouterr()
    assert stickslip(*words, "--json") == 0
    return json.loads(capfd.readouterr().out)


def full_frequency(mesh: Mesh, n: int) -> np.ndarray:
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("foot"))])
    return modes(system, n).frequency


def test_both_ends_of_a_line_are_told(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    line = 'from = ["2 mm", "5 mm", "60 mm"]\nto = ["18 mm", "5 mm", "60 mm"]'
    (home / "bar.toml").write_text(MESH_CASE.replace(line, line.replace("60 mm", "64 mm")))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    said = capfd.readouterr().err
    assert all(f"structure.line[0].{key} = " in said for key in ("from", "to"))
    assert said.count("it lies 4 mm off the face") == 2


@pytest.mark.parametrize("kept", ['["z"]', '["x"]'])
def test_a_check_is_right_where_a_point_keeps_some_directions_alone(
    home: Path, capfd: pytest.CaptureFixture[str], kept: str
) -> None:
    # The other directions of the node that gave up its place are interior.
    point = 'at = ["7 mm", "3 mm", "60 mm"]'
    (home / "bar.toml").write_text(MESH_CASE.replace(point, f"{point}\ndirections = {kept}"))
    result = document(capfd, "reduce", "bar.toml", "--out", "out", "--check")
    assert result["mode_check"]["largest_residual"] < 1e-8


def test_the_point_that_is_proposed_lies_on_the_part_wherever_that_is(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # In the coordinates of a vehicle, and none of them a round number.
    away = np.array([12.3456789, 0.0000123, -3.2100001])
    mesh = bar()
    write_mesh(replace(mesh, points=mesh.points + away), home / "bar.inp")
    text = MESH_CASE.replace('[[structure.line]]\nname = "rim"\nedge = ["top", "side"]\nstations = 4\n', "")
    text = text.replace(text[text.index("[[structure.line]]") : text.index("[structure.reduction]")], "")
    given = 'at = ["12350 mm", "3 mm", "-3140 mm"]'
    (home / "bar.toml").write_text(text.replace('at = ["7 mm", "3 mm", "60 mm"]', given))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    proposed = re.search(r"the nearest point of the face is (\[.*?\]): give that", capfd.readouterr().err)
    assert proposed is not None
    (home / "bar.toml").write_text(text.replace('at = ["7 mm", "3 mm", "60 mm"]', f"at = {proposed[1]}"))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0


@pytest.mark.parametrize("element", ["tet10", "hex20"])
def test_frequencies_are_those_of_the_mesh_and_the_reduced_ones_lie_above(
    home: Path, capfd: pytest.CaptureFixture[str], element: str
) -> None:
    write_mesh(bar(element), home / "bar.inp")
    result = document(capfd, "reduce", "bar.toml", "--out", "out", "--check")
    assert result["mode_check"]["n_below"] == result["mode_check"]["n_found"] > 0
    assert result["mode_check"]["largest_residual"] < 1e-8  # though stations stand in the place of nodes
    full = np.array(result["frequency_hz"])
    # Stations are a change of variables: two solutions by Lanczos agree to 1e-10, twice the digits of an eigenvalue.
    np.testing.assert_allclose(full, full_frequency(bar(element), 10), rtol=1e-8)
    excess = np.array(result["rom_frequency_hz"]) / full - 1
    assert excess.min() > -1e-9
    # Twelve modes of a stubby bar.
    assert excess[:6].max() < 1e-2
    estimate = np.array(result["rom_error"])
    assert (estimate[:6] > excess[:6] / 3).all()  # what `rom_error` promises
    assert result["boundary"] == {"middle": 8, "tip": 3, "rub": 9, "rim": 12}
    with (home / "out" / "bar_frequencies.csv").open() as stream:
        rows = [float(row["full_hz"]) for row in csv.DictReader(stream)]
    np.testing.assert_allclose(rows, full, rtol=1e-8)  # nine digits
    assert load_rom(home / "out" / "bar_rom.h5").modes(1).damping_ratio[0] == pytest.approx(0.01, rel=1e-9)


def test_what_is_recovered_moves_at_the_stations_as_their_coordinates_say(home: Path) -> None:
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0
    rom = load_rom(home / "out" / "bar_rom.h5")
    mesh = read_mesh(home / "out" / "bar.vtu")
    motion = rom.displacement(np.eye(rom.n_dof)[:, : rom.n_boundary])
    with (home / "out" / "bar_stations.csv").open() as stream:
        table = list(csv.DictReader(stream))
    assert [row["name"] for row in table] == ["tip"] + 3 * ["rub"] + 4 * ["rim"]
    for name in ("tip", "rub", "rim"):
        rows = [row for row in table if row["name"] == name]
        at = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
        weights = find_station_weights(mesh, name, mesh.face_sets["top"], at)
        moved = np.einsum("sn,nim->sim", weights.toarray(), motion).reshape(3 * len(rows), -1)
        own = np.eye(rom.n_boundary)[rom.rows(name)]
        # Round-off of a change of variables whose condition is below 1e3.
        np.testing.assert_allclose(moved, own, atol=1e-10)
        assert sum(float(row["length"]) for row in rows) == pytest.approx({"tip": 0, "rub": 0.016, "rim": 0.02}[name])
        normal = [[float(row[f"normal_{axis}"]) for axis in "xyz"] for row in rows]
        np.testing.assert_allclose(normal, np.tile([0, 0, 1.0], (len(rows), 1)), atol=1e-12)


def test_the_set_of_a_mesh_is_kept_in_its_order_and_directions(home: Path) -> None:
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0
    rom = load_rom(home / "out" / "bar_rom.h5")
    rows = rom.rows("middle")
    np.testing.assert_array_equal(rom.boundary_node[rows][::2], bar().node_sets["belt"])
    np.testing.assert_array_equal(rom.boundary_direction[rows], [0, 1] * 4)


def test_a_part_that_nothing_holds_keeps_its_six_rigid_motions(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "bar.toml").write_text(MESH_CASE.replace('[[structure.support]]\non = ["foot"]\n', ""))
    result = document(capfd, "reduce", "bar.toml", "--out", "out")
    assert result["frequency_hz"][:6] == result["rom_frequency_hz"][:6] == [0.0] * 6
    np.testing.assert_allclose(result["rom_frequency_hz"][6:8], result["frequency_hz"][6:8], rtol=1e-2)


def test_a_second_run_computes_nothing_and_other_modes_no_matrices(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0

    def fail(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("study.kind.part.stages.assemble_compact", fail)
    (home / "bar.toml").write_text(MESH_CASE.replace("modes = 12", "modes = 6"))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0
    (home / "bar.toml").write_text(MESH_CASE)
    monkeypatch.setattr("study.reduce.comparison.craig_bampton", fail)
    assert stickslip("reduce", "bar.toml", "--out", "again") == 0
    assert (home / "again" / "bar_rom.h5").exists()
    # A check takes the kept reduction, and is kept itself.
    assert stickslip("reduce", "bar.toml", "--out", "again", "--check") == 0
    monkeypatch.setattr("study.kind.part.stages.check_fixed_interface_modes", fail)
    assert stickslip("reduce", "bar.toml", "--out", "again", "--check") == 0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'file = "bar.inp"',
            'file = "no.inp"',
            'bar.toml:5: structure.file = "no.inp": mesh file no.inp does not exist',
        ),
        ('kind = "part"', 'kind = "pat"', 'bar.toml:4: structure.kind = "pat": must be '),
        ('kind = "part"', 'kind = "pat"', 'did you mean "part"'),
        ('length_unit = "m"', 'length_unit = "kg"', 'length_unit = "kg"'),
        ('length_unit = "m"', "length_unit = 1", "is the unit of the coordinates in the file"),
        (
            'on = ["foot"]',
            'on = ["hand"]',
            'structure.support[0].on = ["hand"]: "hand" does not exist: the sets of bar.inp are belt',
        ),
        ('name = "rub"', 'name = "tip"', 'structure.line[0].name = "tip": "tip" is used twice'),
        (
            '"7 mm", "3 mm", "60 mm"',
            '"7 mm", "3 mm", "80 mm"',
            'bar.toml:17: structure.point[0].at = ["7 mm", "3 mm", "80 mm"]: it lies 20 mm off the face; '
            'the nearest point of the face is ["7 mm", "3 mm", "60 mm"]: give that',
        ),
        (
            '"18 mm", "5 mm", "60 mm"',
            '"18 mm", "5 mm", "62 mm"',
            'structure.line[0].to = ["18 mm", "5 mm", "62 mm"]: it lies 2 mm off the face; the nearest '
            'point of the face is ["18 mm", "5 mm", "60 mm"]: give that',
        ),
        (
            '"2 mm", "5 mm", "60 mm"',
            '"2 mm", "5 mm", "57 mm"',
            'structure.line[0].from = ["2 mm", "5 mm", "57 mm"]: it lies 3 mm off the face; the nearest '
            'point of the face is ["2 mm", "5 mm", "60 mm"]: give that',
        ),
        (
            '"18 mm", "5 mm", "60 mm"',
            '"2 mm", "5 mm", "60 mm"',
            'structure.line[0].to = ["2 mm", "5 mm", "60 mm"]: the line "rub" b',
        ),
        (
            'edge = ["top", "side"]',
            'edge = ["top", "foot"]',
            'structure.line[1].edge = ["top", "foot"]: the line "rim": the faces "top" and "foot" do not meet: n',
        ),
        ('edge = ["top", "side"]', 'edge = ["top", "top"]', 'edge names "top" twice'),
        ('on = "top"\nfrom', "from", "give a face with two of its points"),
        ("stations = 3", "stations = 30", "no node can be moved to station "),
        (
            'on = "belt"',
            'on = "foot"',
            'structure.boundary[0].on = "foot": all 45 nodes of "middle" are fixed along x, y: retain another set',
        ),
        ("modes = 12", "modes = -1", "structure.reduction.modes"),
        ('young = "2.1e+11 Pa"', 'young = "-1 Pa"', "structure.material.young"),
    ],
)
def test_mistakes_are_told_with_file_and_key(
    home: Path, capfd: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    assert old in MESH_CASE
    (home / "bar.toml").write_text(MESH_CASE.replace(old, new))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert said in capfd.readouterr().err
    assert not (home / "out").exists()


def test_sets_of_faces_and_of_nodes_are_drawn(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = {}

    def draw(mesh: Mesh, faces: dict, stations: np.ndarray, path: Path, *, nodes: dict, **_: object) -> None:
        seen.update(faces=list(faces), stations=len(stations), **nodes)
        path.write_bytes(b"")

    monkeypatch.setattr("study.kind.part.reduce._draw_pictures", drawn)
    monkeypatch.setattr("study.kind.part.reduce.picture_modes", lambda *_: [])
    monkeypatch.setattr("study.kind.part.stages.named_faces_picture", draw)
    # Held too, by a set of nodes.
    (home / "bar.toml").write_text(
        MESH_CASE.replace('on = ["foot"]', 'on = ["foot", "belt"]').split("[[structure.boundary]]")[0]
    )
    assert stickslip("reduce", "bar.toml", "--out", "out") == 0
    assert (seen["faces"], seen["stations"]) == (["foot", "top", "side"], 7)
    np.testing.assert_allclose(seen["tip"], [[0.007, 0.003, 0.06]], atol=1e-12)
    np.testing.assert_allclose(seen["belt"], bar().points[bar().node_sets["belt"]], atol=1e-12)


def test_a_part_without_anything_physical_and_other_commands_are_refused(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bare = MESH_CASE.split("[[structure.support]]")[0]
    (home / "bar.toml").write_text(bare)
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert "no degree of freedom is retained: add a [[structure.point]]" in capfd.readouterr().err
    assert stickslip("modes", "bar.toml", "--out", "out") == 2
    said = capfd.readouterr().err
    assert "case of a part" in said
    assert "`stickslip reduce`" in said
    for command in ("solve", "limits"):
        assert stickslip(command, "bar.toml", "--out", "out") == 2
        assert "there is no [sweep]" in capfd.readouterr().err


def test_what_supports_leave_free_the_kept_points_may_hold(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "bar.toml").write_text(MESH_CASE.replace('on = ["foot"]', 'on = ["foot"]\ndirections = ["z"]'))
    result = document(capfd, "reduce", "bar.toml", "--out", "out")
    frequency = np.array(result["frequency_hz"])
    # It slides along x and y and turns about z.
    np.testing.assert_array_equal(frequency[:3], 0.0)
    assert (frequency[3:] > 1.0).all()
    # Twelve interior modes leave a truncation error that grows with frequency, 0.02 % at the fifth.
    np.testing.assert_allclose(result["rom_frequency_hz"][:5], frequency[:5], rtol=1e-3)


def test_more_than_the_memory_is_refused_before_it_is_taken(
    home: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("reduction.memory_estimate.read_available_memory", lambda: 1e6)
    monkeypatch.setattr("study.kind.part.stages.assemble_compact", None)
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    said = capfd.readouterr().err
    assert "GB of memory, but 0.001 GB are free: take larger elements" in said


def test_the_reduced_part_is_solved_by_the_names_of_its_points(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    first = document(capfd, "reduce", "bar.toml", "--out", "out")["rom_frequency_hz"][0]
    solve = f"""schema = 2
[structure]
kind = "plain"
file = "out/bar_rom.h5"
[[load]]
at = "tip"
direction = "y"
amplitude = "1 N"
[[sensor]]
name = "tip"
at = "rub"
station = 1
direction = [0, 1, 0]
[sweep]
parameter = "frequency"
from = "{0.99 * first} Hz"
to = "{1.01 * first} Hz"
step = "{first / 2000} Hz"
[harmonics]
highest = 1
"""
    (home / "solve.toml").write_text(solve)
    (curve,) = document(capfd, "solve", "solve.toml", "--out", "solved")["curves"]
    # The peak lies a factor sqrt(1 - 2 zeta^2) below the frequency, between points 1/2000 apart.
    assert curve["peak_frequency_hz"] == pytest.approx(first, rel=2e-3)


#: A plate rubs on the end of the bar, at the stations of its contact line and across it.
PLATE = """
[[place]]
name = "end"
at = "tip"
direction = "y"
[[line]]
name = "plate"
normal = { row = "rub normal" }
tangent = { row = "rub across" }
shares = [1, 2, 1]
normal_stiffness = "8 N/um"
tangential_stiffness = "4 N/um"
friction_coefficient = 0.5
preload = "60 N"
balanced_preload = true
[[joint]]
kind = "cubic"
name = "stop"
place = "end"
stiffness = "1e6 N/m^3"
[[load]]
place = "end"
amplitude = "0.1 N"
[[sensor]]
name = "end"
place = "end"
[[sensor]]
name = "friction"
line = "plate"
component = "tangential"
[harmonics]
highest = 3
"""


def test_one_case_of_a_part_is_reduced_and_solved_with_its_joints(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    case = home / "bar.toml"
    case.write_text(MESH_CASE + PLATE)
    free = document(capfd, "reduce", "bar.toml", "--out", "out")["rom_frequency_hz"][0]
    read = read_case(case)
    assert [joint.name for joint in read.model.system.joints] == ["plate.1", "plate.2", "plate.3", "stop"]
    assert [sensor.name for sensor in read.model.sensors] == ["end", "friction"]
    system = read.model.system
    stuck = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    omega, shape = np.sqrt(stuck.lambda_[0]), stuck.mode_shapes[:, 0]
    first = omega / (2 * np.pi)
    # 4 N/um beside the bar's own 3 E I / L^3 of 5 N/um.
    assert first > 1.1 * free
    sweep = f'[sweep]\nfrom = "{0.98 * first} Hz"\nto = "{1.02 * first} Hz"\nstep = "{first / 2000} Hz"\n'
    case.write_text(MESH_CASE + PLATE + sweep)
    (curve,) = document(capfd, "solve", "bar.toml", "--out", "solved")["curves"]
    # At 0.1 N all stations stick; the peak lies a factor sqrt(1 - 2 zeta^2) below, between points 1/2000 apart.
    assert curve["peak_frequency_hz"] == pytest.approx(first, rel=2e-3)
    # The mode alone; the others add their static parts, across the phase.
    modal = 1e6 * 0.1 * (read.model.places["end"] @ shape) ** 2 / (omega * (shape @ system.damping @ shape))
    assert curve["peak_amplitude"] == pytest.approx(modal, rel=5e-3)


# STEP files, written by the CAD kernel from plain boxes.


def write_step(path: Path, *boxes: tuple[float, float, float]) -> None:
    """Boxes of 20 x 10 x 60 mm with their corners there [mm]."""
    import cadquery as cq

    made = [cq.Solid.makeBox(20, 10, 60).translate(cq.Vector(*corner)) for corner in boxes]
    cq.exporters.export(cq.Workplane(cq.Compound.makeCompound(made) if len(made) > 1 else made[0]), str(path))


@pytest.fixture
def cad(home: Path) -> Path:
    write_step(home / "bar.step", (0, 0, 0))
    (home / "text.step").write_text("no STEP file\n")
    (home / "bar.toml").write_text(STEP_CASE)
    return home


@needs_tetwild
def test_a_step_file_is_meshed_and_reduced_and_calculix_finds_the_same_on_that_mesh(
    cad: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A mistake that shows on the mesh alone: what was finished before is kept.
    (cad / "bar.toml").write_text(STEP_CASE.replace('"18 mm", "5 mm", "60 mm"', '"18 mm", "5 mm", "66 mm"'))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert '"66 mm"]: it lies 6 mm off the face' in capfd.readouterr().err

    def fail(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("study.kind.part.stages.mesh_solid", fail)
    (cad / "bar.toml").write_text(STEP_CASE)
    result = document(capfd, "reduce", "bar.toml", "--out", "out")
    assert result["boundary"] == {"tip": 3, "rub": 9, "rim": 12}
    assert result["least_scaled_jacobian"] > 0.02
    assert {name: item["n_face"] for name, item in result["faces"].items()} == {"foot": 1, "top": 1, "side": 1}
    assert result["faces"]["side"]["area_mm2"] == pytest.approx(20 * 60)
    assert result["faces"]["side"]["centre_mm"] == pytest.approx([10, 0, 30])
    # Tetrahedra of 6 mm against such of 5 mm cut from bricks: both a few parts in a thousand too stiff.
    np.testing.assert_allclose(result["frequency_hz"][:6], full_frequency(bar(), 6), rtol=5e-3)
    mesh = read_mesh(cad / "out" / "bar.vtu")
    assert integrate_areas(mesh, mesh.face_sets["side"]).sum() == pytest.approx(0.02 * 0.06, rel=1e-9)
    if find_ccx() is not None:
        held = mesh.nodes("foot")
        fixed = np.column_stack([np.repeat(held, 3), np.tile([0, 1, 2], len(held))])
        # As in test_calculix_witness: the digits of the deck and the condition of the stiffness.
        np.testing.assert_allclose(result["frequency_hz"][:6], run_frequency(mesh, STEEL, fixed, 6), rtol=1e-8)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"bar.step"', '"no.step"', 'bar.toml:5: structure.file = "no.step": the STEP file no.step cannot be read'),
        (
            '"bar.step"',
            '"text.step"',
            'file = "text.step": text.step is not a STEP file, which begins with "ISO-10303-21;": name one',
        ),
        (
            '"bar.step"',
            '"bar.inp"',
            '[structure.mesh] is for STEP files, which end in .step, .stp; file = "bar.inp" is read as a mesh',
        ),
        (
            "normal = [0, 0, -1]",
            "normal = [0, 1, -1]",
            'bar.toml:8: structure.face[0]: no face of bar.step fits "foot"',
        ),
        (
            "normal = [0, -1, 0]",
            "normal = [0, -1, 1]",
            'bar.toml:14: structure.face[2]: no face of bar.step fits "side"',
        ),
        ("normal = [0, 0, -1]", "normal = [0, 0, 0]", "structure.face[0].normal"),
        ("normal = [0, 0, -1]", "normal = [0, 0, 1]", "bar.toml:11: structure.face[1]: bar.step: the plane"),
        ("normal = [0, 0, -1]", 'colour = "red"', 'colour = "red"'),
        ("normal = [0, 0, -1]", 'step_name = "A"', 'no face of bar.step fits "foot" (name = A)'),
        ('size = "6 mm"', 'size = "0 mm"', "structure.mesh.size"),
        ('size = "6 mm"', 'size = "1 um"', "GB are free: take larger elements"),
        (
            'size = "6 mm"',
            'size = "6 mm"\nnear = { bore = "1 mm" }',
            'structure.mesh.near.bore = "1 mm": bar.step: a cell size is given near the face "bore", but the',
        ),
        ('on = ["foot"]', 'on = ["hand"]', '"hand" does not exist: the faces of this case are foot, side, top'),
    ],
)
def test_mistakes_of_a_step_case_are_told_before_anything_is_meshed(
    cad: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, old: str, new: str, said: str
) -> None:
    monkeypatch.setattr("study.kind.part.stages.mesh_solid", None)
    assert old in STEP_CASE
    (cad / "bar.toml").write_text(STEP_CASE.replace(old, new))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert said in capfd.readouterr().err


def test_faces_that_a_loose_selector_takes_together_are_seen_before_anything_is_meshed(
    cad: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # Both long sides of the bar, and a mistake that stops the run once the faces are known.
    loose = STEP_CASE.replace("normal = [0, -1, 0]", 'area = ["1199 mm^2", "1201 mm^2"]').replace("6 mm", "1 um")
    (cad / "bar.toml").write_text(loose)
    assert main(["reduce", "bar.toml", "--out", "out"]) == 2
    said = capfd.readouterr().err
    assert "stickslip:   side           2       2400.00   (10.00, 5.00, 30.00)" in said
    assert "stickslip:   foot           1        200.00   (10.00, 5.00, 0.00)" in said


def test_open_shells_and_overlapping_solids_are_refused_with_the_place_in_the_case(
    cad: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    import cadquery as cq

    write_step(cad / "bar.step", (0, 0, 0), (0, 0, 50))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    said = capfd.readouterr().err
    assert (
        'bar.toml:5: structure.file = "bar.step": bar.step holds 2 solids, of which number 1 and 2 overlap by 2e+03'
        in said
    )
    faces = [face for face in cq.Solid.makeBox(20, 10, 60).Faces() if face.Center().z < 59]
    cq.exporters.export(cq.Workplane(cq.Compound.makeCompound(faces)), str(cad / "bar.step"))
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert 'file = "bar.step": bar.step holds an open surface, 4 edges' in capfd.readouterr().err


def test_without_pytetwild_one_sentence_says_what_to_install(
    cad: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fe.mesher.ftetwild.MODULE", "no_such_module")
    assert stickslip("reduce", "bar.toml", "--out", "out") == 2
    assert "pytetwild, which is not installed: sh install.sh" in capfd.readouterr().err
