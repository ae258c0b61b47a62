"""A case of plain matrices: what the file says is the model, and every mistake has its line."""

import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

from casefile.errors import CaseError
from correlation.model import LineSensor, Model, Sensor
from reduction.file.rom_hdf5 import save_rom
from reduction.jointed_system import CubicSpring
from reduction.rom import ReducedModel
from study.beam.case import write_beam_case
from study.beam.model import beam_model
from study.case.setup import read_case
from study.kind.registry import open_case
from study.shipped_cases import BEAM

K = 1e6 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
M = np.diag([1.0, 2, 0.5])
ROWS = np.array([[0.0, 1, 0], [0, 0.5, 0.5]])

CASE = """\
schema = 2
[structure]
kind = "plain"
file = "chain.npz"
[structure.damping]
mass_factor = "3 1/s"
stiffness_factor = "2 us"
[[place]]
name = "end"
node = 7
direction = "z"
[[place]]
name = "middle"
row = "rows"
[[sensor]]
name = "a"
place = "end"
quantity = "acceleration"
gain = "102 %"
[[sensor]]
name = "b"
weights = { 0 = 1.0, 2 = -1.0 }
[[sensor]]
name = "T"
line = "left"
component = "tangential"
[[line]]
name = "left"
normal = [{ dof = 0 }, { body = "bar", node = 6, direction = "z" }]
tangent = { row = "rows" }
normal_stiffness = ["2 N/um", "3 N/um"]
tangential_stiffness = "1 N/um"
friction_coefficient = 0.4
preload = "5 N"
balanced_preload = true
[[joint]]
kind = "cubic"
name = "cubic"
dof = 2
stiffness = "2 N/mm^3"
[[load]]
dof = 2
phase = "90 deg"
[[static_load]]
dof = 1
force = "3 N"
[[dead_weight]]
name = "weight"
row = "rows"
force = "2 N"
presses = ["left"]
[accepted]
kt = "7 %"
E = 0
[numerical_error]
frequency = "0.1 %"
[harmonics]
highest = 3
samples = 64
[effects]
files = ["mine.py"]
without = ["cubic"]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    np.savez(
        tmp_path / "chain.npz",
        M=M,
        K=K,
        rows=ROWS,
        dof_body=np.array(["bar"] * 3),
        dof_node=np.array([5, 6, 7]),
        dof_direction=np.array(["z"] * 3),
        part_base_mass=0.25 * M,
        part_base_stiffness=K,
        part_tip_mass=0.75 * M,
    )
    (tmp_path / "mine.py").write_text("def candidates(model):\n    return []\n", encoding="utf-8")
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_that_the_file_says_is_in_the_model(folder: Path) -> None:
    setup = read_case(written(folder, CASE)).setup
    model = setup.model
    np.testing.assert_array_equal(model.system.mass, M)
    np.testing.assert_allclose(model.system.damping, 3 * M + 2e-6 * K)
    first, second = (model.contact(name) for name in model.lines["left"])
    assert (first.normal_stiffness, second.normal_stiffness) == (2e6, 3e6)
    assert first.preload == second.preload == 5.0
    np.testing.assert_array_equal(second.normal, [0, 1, 0])
    np.testing.assert_array_equal(second.tangents[0], ROWS[1])
    np.testing.assert_array_equal(model.system.static, [5, 5 + 3, 0])
    np.testing.assert_allclose(model.system.dynamic[1], [0, 0, 1j], atol=1e-15)
    assert isinstance(model.system.joints[-1], CubicSpring)
    acceleration, relative, line = model.sensors
    assert isinstance(acceleration, Sensor)
    assert (acceleration.quantity, acceleration.gain) == ("acceleration", 1.02)
    np.testing.assert_array_equal(acceleration.row, [0, 0, 1])
    assert isinstance(relative, Sensor)
    np.testing.assert_array_equal(relative.row, [1, 0, -1])
    assert isinstance(line, LineSensor)
    np.testing.assert_array_equal(model.places["middle"], ROWS.mean(axis=0))
    np.testing.assert_array_equal(model.dead_weights["weight"].row, 2 * ROWS.mean(axis=0))
    assert model.preloads == ("weight",)
    assert [part.name for part in model.parts] == ["base", "tip"]
    np.testing.assert_array_equal(model.parts[1].stiffness, 0 * K)
    assert (model.n_harmonic, model.n_sample) == (4, 64)
    assert {item.name: item.deviation for item in setup.calibration_parameters} == {
        "kt": 0.07,
        "kn": 0.1,
        "mu": 0.1,
        "zeta": 0.2,
    }
    assert (setup.budget.frequency, setup.budget.compliance) == (1e-3, 0.01)
    assert (setup.effect_files, setup.without) == ((folder / "mine.py",), ("cubic",))


def test_the_shipped_beam_is_that_of_the_bench(tmp_path: Path) -> None:
    read, model = read_case(BEAM).setup.model, beam_model(24)
    for name in ("mass", "stiffness"):
        np.testing.assert_array_equal(getattr(read.system, name), getattr(model.system, name))
    # Two eigenvalues are in it: their round-off, 1e-16 times the ratio of the largest to the first, is the processor's.
    np.testing.assert_allclose(read.system.damping, model.system.damping, rtol=1e-9)
    # Decimal numbers of the case, and the row of a node, are right to rounding.
    close = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(read.system.static, model.system.static, **close)
    np.testing.assert_allclose(read.system.dynamic, model.system.dynamic, **close)
    assert read.lines == model.lines
    for names in model.lines.values():
        for name in names:
            ours, theirs = read.contact(name), model.contact(name)
            np.testing.assert_array_equal(ours.directions, theirs.directions)
            for field in ("normal_stiffness", "tangential_stiffness", "friction_coefficient", "preload", "gap"):
                assert getattr(ours, field) == pytest.approx(getattr(theirs, field), rel=1e-12, abs=1e-18), field
    assert [item.name for item in read.sensors] == [item.name for item in model.sensors]
    for ours, theirs in zip(read.sensors, model.sensors, strict=True):
        assert type(ours) is type(theirs)
        if isinstance(ours, Sensor) and isinstance(theirs, Sensor):
            np.testing.assert_allclose(ours.row, theirs.row, **close)
    assert {*read.places} == {*model.places}
    for ours, theirs in zip(read.dofs, model.dofs, strict=True):
        assert (ours.body, ours.node, ours.direction) == (theirs.body, theirs.node, theirs.direction)
        np.testing.assert_array_equal(ours.coordinates, theirs.coordinates)
    assert read.n_harmonic == model.n_harmonic
    assert read.linked_preloads == model.linked_preloads == (("left", "right"),)
    write_beam_case(tmp_path)
    for file in ("beam.toml", "beam_finer.toml"):
        assert (tmp_path / file).read_bytes() == BEAM.with_name(file).read_bytes(), "run python -m study.beam.case"


def parabola(model: Model) -> np.ndarray:
    x = np.array([0.0 if dof.coordinates is None else dof.coordinates[0] for dof in model.dofs])
    return np.where([dof.direction == "z" for dof in model.dofs], x**2, 2 * x)


def test_the_finer_beam_is_the_same_with_more_of_all() -> None:
    setup = read_case(BEAM).setup
    (finer,) = setup.budget.refined
    assert finer.system.n_dof == 2 * setup.model.system.n_dof
    assert finer.n_harmonic > setup.model.n_harmonic
    for line, names in setup.model.lines.items():
        assert finer.lines[line] == names
        for name in names:
            # The same point of the same beam: cubic elements of any size follow w = x^2 exactly.
            ours, theirs = (model.contact(name).normal @ parabola(model) for model in (setup.model, finer))
            assert ours == pytest.approx(theirs, rel=1e-12)


def test_a_reduced_model_knows_its_boundary(tmp_path: Path) -> None:
    rom = ReducedModel(
        mass=M,
        damping=0 * M,
        stiffness=K,
        boundary_node=np.array([4, 4]),
        boundary_direction=np.array([0, 2]),
        boundary_sets={"foot": np.array([0, 1])},
        fixed_interface_frequency=np.array([100.0]),
        recovery=np.eye(3),
        free=np.array([12, 14, 3]),
        n_node=5,
    )
    save_rom(rom, tmp_path / "rom.h5")
    text = (
        'schema = 2\n[structure]\nkind = "plain"\nfile = "rom.h5"\n[[load]]\nat = "foot"\ndirection = "z"\n'
        '[[sensor]]\nname = "s"\nbody = "foot"\nnode = 4\ndirection = "x"\n'
    )
    model = read_case(written(tmp_path, text)).setup.model
    np.testing.assert_array_equal(model.system.dynamic[1], [0, 1, 0])
    assert isinstance(model.sensors[0], Sensor)
    np.testing.assert_array_equal(model.sensors[0].row, [1, 0, 0])
    assert [dof.direction for dof in model.dofs] == ["x", "z", "modal"]


MISTAKES = {
    "two ways": ("dof = 2\nphase", "dof = 2\nnode = 7\nphase", "load[0]: dof and node are given: give one of dof"),
    "no node": (
        "node = 7",
        "node = 9",
        "place[0].node = 9: node = 9 is not a node of the structure: it has nodes 5 to 7",
    ),
    "direction not kept": (
        'direction = "z"\n[[place]]',
        'direction = "ry"\n[[place]]',
        "does not exist at node = 7: it has",
    ),
    "no stored row": ('name = "middle"\nrow = "rows"', 'name = "middle"\nrow = "row"', 'did you mean "rows"?'),
    "no place": ('place = "end"', 'place = "start"', 'place = "start" is not in the case'),
    "no line": ('line = "left"', 'line = "wall"', 'line = "wall" is not in the case: there are left'),
    "pressed twice": (
        "balanced_preload = true",
        'pressed_by = "screw"',
        'pressed_by = "screw": dead weight "weight" presses this line; remove one of them',
    ),
    "pressed by a weight of others": (
        '[[joint]]\nkind = "cubic"',
        '[[line]]\nname = "right"\nnormal = { dof = 0 }\ntangent = { dof = 1 }\nnormal_stiffness = "1 N/um"\n'
        'tangential_stiffness = "1 N/um"\nfriction_coefficient = 0.4\npressed_by = "weight"\n'
        '[[joint]]\nkind = "cubic"',
        'pressed_by = "weight" is a dead weight: list the line in its presses instead',
    ),
    "nothing pressed": ('presses = ["left"]', 'presses = ["right"]', 'presses: "right" is not a line of the case'),
    "weight and line": (
        'name = "weight"',
        'name = "left"',
        'name = "left" is already used by line[0]: give each a different name',
    ),
    "name twice": ('name = "b"', 'name = "a"', 'name = "a" is already used by sensor[0]: give each a different name'),
    "too few values": ('["2 N/um", "3 N/um"]', '["2 N/um", "3 N/um", "4 N/um"]', "has 3 values for 2 contacts"),
    "rows do not match": ('tangent = { row = "rows" }', "tangent = { dof = 1 }", "tangent has 1 rows, normal 2"),
    "shares and own": ("balanced", "shares = [1, 2]\nbalanced", "normal_stiffness has a value for each contact, but"),
    "unit": ('preload = "5 N"', 'preload = "5 m"', 'preload = "5 m": "m" makes it a length, but a force is needed'),
    "decimal comma": ('preload = "5 N"', 'preload = "5,2 N"', "write a decimal point, not a comma"),
    "two dampings": (
        "[structure.damping]",
        '[structure.damping]\nratio = "1 %"',
        "give either ratio, or mass_factor and stiffness_factor",
    ),
    "harmonic": (
        "phase",
        "harmonic = 4\nphase",
        "harmonic = 4: harmonics.highest = 3 drops this load; take at least 4",
    ),
    "samples": ("samples = 64", "samples = 8", "samples = 8 are too few for harmonics 0 to 3: take at least 13"),
    "no effect file": ('"mine.py"', '"yours.py"', "there is no file"),
    "few dofs": (
        "[[static_load]]",
        "[[structure.dof]]\n[[static_load]]",
        "1 tables [[structure.dof]] for 3 degrees of freedom",
    ),
    "refined is itself": ("[harmonics]", 'refined = ["case.toml"]\n[harmonics]', "is this case"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_sentence_with_its_line(folder: Path, name: str) -> None:
    old, new, expected = MISTAKES[name]
    assert CASE.count(old) >= 1
    path = written(folder, CASE.replace(old, new, 1))
    with pytest.raises(CaseError) as caught:
        read_case(path)
    (problem,) = caught.value.problems
    assert expected in str(problem), str(problem)
    assert problem.line > 0
    assert re.match(rf"{re.escape(str(path))}:\d+: ", str(problem))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('name = "middle"', 'name = "centre"', 'has no place "middle", where an effect may act: add it there'),
        ('name = "a"', 'name = "c"', 'has no sensor "a": give both cases the same sensors'),
    ],
)
def test_a_finer_case_has_the_same_names(folder: Path, old: str, new: str, expected: str) -> None:
    (folder / "finer.toml").write_text(CASE.replace(old, new), encoding="utf-8")
    case = written(folder, CASE.replace("[harmonics]", 'refined = ["finer.toml"]\n[harmonics]'))
    with pytest.raises(CaseError, match=expected):
        read_case(case)


def test_all_mistakes_come_at_once(folder: Path) -> None:
    text = (
        CASE.replace("node = 7", "node = 9")
        .replace('line = "left"', 'line = "wall"')
        .replace("dof = 2\nphase", "dof = 5\nphase")
    )
    with pytest.raises(CaseError) as caught:
        read_case(written(folder, text))
    # The sensor at the place that does not exist is no fourth one.
    assert len(caught.value.problems) == 3


def test_parts_add_up_to_the_structure(folder: Path) -> None:
    np.savez(folder / "chain.npz", M=M, K=K, part_base_mass=0.5 * M, part_base_stiffness=K)
    with pytest.raises(CaseError, match="the parts base do not add up to the mass: store all parts, or none"):
        read_case(written(folder, CASE))


def cases_of_documents() -> dict[str, str]:
    """Text of every whole case in the documents, by file and line."""
    result = {}
    for file in sorted((Path(__file__).parents[2] / "docs").glob("*.md")):
        text = file.read_text(encoding="utf-8")
        for block in re.finditer(r"^    schema = 2\n(?:^    .*\n|^\n)*", text, re.MULTILINE):
            result[f"{file.name}:{text[: block.start()].count(chr(10)) + 1}"] = textwrap.dedent(block.group())
    return result


@pytest.mark.parametrize("text", cases_of_documents().values(), ids=cases_of_documents().keys())
def test_every_case_of_the_documents_is_valid(tmp_path: Path, text: str) -> None:
    assert open_case(written(tmp_path, text)).case.structure.kind == open_case(tmp_path / "case.toml").kind.name


def test_the_case_of_the_document_can_be_read(tmp_path: Path) -> None:
    document = (Path(__file__).parents[2] / "docs" / "compare.md").read_text(encoding="utf-8")
    block = re.search(r"(?:^    .*\n|^\n)+", document[document.index("    schema = 2") :], re.MULTILINE)
    assert block is not None
    stiffness = 1e6 * (2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1))
    directions = np.array(["z"] * 8)
    np.savez(tmp_path / "bar.npz", M=np.eye(8), K=stiffness, dof_direction=directions, wall_normal=np.eye(8)[[1, 3, 5]])
    model = read_case(written(tmp_path, textwrap.dedent(block.group()))).setup.model
    assert model.lines == {"wall": ("wall.1", "wall.2", "wall.3")}
    assert [model.contact(name).preload for name in model.lines["wall"]] == [4.0, 16.0, 4.0]
    assert [model.contact(name).gap for name in model.lines["wall"]] == [0.0, 5e-7, 1e-6]
    np.testing.assert_array_equal(model.system.static, [0, 4, 0, 16, 0, 4, 0, 0])


def test_a_structure_of_another_kind_is_one_sentence_with_the_right_one(tmp_path: Path) -> None:
    text = 'schema = 2\n[structure]\nkind = "rig"\nfile = "beam.npz"\ndof = "dof.csv"\n'
    with pytest.raises(CaseError) as error:
        open_case(written(tmp_path, text))
    (problem,) = error.value.problems
    assert (problem.line, problem.key) == (3, "structure.kind")
    assert "dof, file" in problem.text
    assert '"plain"' in problem.text
