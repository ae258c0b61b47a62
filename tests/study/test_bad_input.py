"""Bad input to a command: exit code 2, and one sentence with file, field, value and remedy."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fe.element import HEX8
from fe.file.mesh_file import write_mesh
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from study import cli

Refusal = Callable[..., str]


@pytest.fixture
def refusal(at_home: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Refusal:
    """Run a command in this process; it must refuse its input before anything is computed or drawn."""
    for package in ("study.modes.run", "study.table1.report"):
        monkeypatch.setattr(f"{package}.require_egl", lambda: None)
    monkeypatch.setattr("pipeline.parallel._start", lambda *_: pytest.fail("a computation was started"))

    def run(*words: str) -> str:
        assert cli.main([*words, "--quiet"]) == 2
        result = capsys.readouterr()
        assert result.out == ""
        assert "Traceback" not in result.err
        assert not list(at_home.glob("stickslip-error-*"))
        return result.err

    return run


CASE_MISTAKES = [
    # A negative or absurd dimension, a self-intersecting blade.
    (
        "plain",
        'length = "201.6 mm"',
        'length = "-201.6 mm"',
        'blade.length = "-201.6 mm": .* is not positive (in Python',
    ),
    (
        "plain",
        'length = "201.6 mm"',
        'length = "201.6 m"',
        'blade.length = "201.6 m": .* is longer than any rig (in Python',
    ),
    ("plain", 'chord = "24 mm"', 'chord = "1 um"', 'blade.chord = "1 um": .* is thinner than can be made (in Python'),
    ("plain", 'root_thickness = "12 mm"', 'root_thickness = "5 mm"', "exceeds root_thickness = 5 mm (lower the one or"),
    ("plain", 'excitation_height = "20 mm"', 'excitation_height = "0.3 m"', "is not below the tip at length = 201.6"),
    ("rig", 'contact_height = "125 mm"', 'contact_height = "245 mm"', 'blade.contact_height = "245 mm": .* (lower it)'),
    ("rig", 'contact_height = "125 mm"', 'contact_height = "3 mm"', "into the root block (raise it)"),
    ("rig", 'flat_width = "22 mm"', 'flat_width = "14 mm"', "break through the sides of the pads (widen it or"),
    ("rig", 'lip_above_axis = "3 mm"', 'lip_above_axis = "6 mm"', 'blade.lip_above_axis = "6 mm": .* closes the gr'),
    ("rig", 'cone_half_angle = "8.53 deg"', 'cone_half_angle = "8.53"', 'give a unit, e.g. "8.53 deg"'),
    # Zero elements, a mesh that cannot be made.
    ("rig", "elements_through_thickness = 3", "elements_through_thickness = 0", "thickness = 0: must be"),
    ("rig", "length_ratio = 2.30", "length_ratio = 0.0", "length_ratio = 0 must be positive: 2.4 is a usual value"),
    ("rig", 'length_cap = "8 mm"', 'length_cap = "-8 mm"', 'mesh.length_cap = "-8 mm": .* 8 mm is a usual value'),
    ("rig", "across_groove = 6", "across_groove = 5", "mesh.pads.across_groove = 5: .* give an even number"),
    ("rig", "above_groove = 4", "above_groove = 0", "mesh.pads.above_groove = 0: must be greater than or equal to 1"),
    ("rig", "along_contact = 6", "along_contact = 5", "mesh: station 4 of .* give the contact line a"),
    ("rig", 'length_cap = "20 mm"', 'length_cap = "-20 mm"', 'limit.length_cap = "-20 mm": .* 8 mm is a usual value'),
    ("rig", "across_groove = 2", "across_groove = 3", "limit.pads: .* across_groove = 3 elements: give an even number"),
    ("rig", "[1, 2, 4]", "[1, 2, 3]", "limit.subdivisions = [1, 2, 3]: must grow by a constant ratio, e.g. [1, 2, 4]"),
    ("rig", "[1, 2, 4]", "[1, 1, 1]", "limit.subdivisions = [1, 1, 1]: must grow by a constant ratio"),
    ("rig", "[1, 2, 4]", "[4, 2, 1]", "limit.subdivisions = [4, 2, 1]: must grow by a constant ratio"),
    # Unknown keys and units.
    ("rig", "length_ratio = 2", "lenght_ratio = 2", 'mesh.lenght_ratio: unknown key; did you mean "length_ratio"?'),
    ("rig", "[root]", "[roots]", 'roots: unknown table; did you mean "root"?'),
    ("rig", 'kind = "rig"', 'kind = "wing"', 'blade.kind = "wing": must be "rig" or "plain"'),
    ("rig", '"250.4 mm"', '"250.4 mn"', 'blade.length = "250.4 mn": unknown unit "mn"; did you mean "mN"?'),
    ("rig", '"250.4 mm"', '"250.4 kg"', '"kg" makes it a mass, but a length is needed, e.g. "250 mm"'),
    ("rig", '"250.4 mm"', "250.4", 'blade.length = 250.4: give a unit, e.g. "250 mm"'),
    ("rig", 'element = "hex8"', 'element = "tet4"', 'model[0].element = "tet4": must be "hex8" or "hex20"'),
    ("rig", 'root = "full"', 'root = "loose"', 'model[0].root = "loose": must be "full" or "relaxed"'),
    # Values out of range.
    ("rig", "drop_every = 6", "drop_every = 1", "root.drop_every = 1: must be greater than or equal to 2"),
    ("rig", "modes = 150", "modes = 0", "reduction.modes = 0: must be greater than or equal to 1"),
    ("rig", 'ratio = "0.2 %"', 'ratio = "-0.2 %"', 'damping.ratio = "-0.2 %": must be greater than 0'),
    ("rig", "poisson = 0.3", "poisson = 0.5", "material.poisson = 0.5: .* must lie between -1 and 0.5: steel has 0.3"),
    ("rig", 'young = "210 GPa"', 'young = "-210 GPa"', 'material.young = "-210 GPa": .* steel has 210e9 Pa'),
    ("rig", "thickness_factor = 1.25", "thickness_factor = 1e4", "prediction[2]: .* is longer than any rig (in Python"),
    ("rig", 'element = "hex8"\nelements_through_thickness = 2', 'element = "hex20"\nelements_through_thickness = 2',
     'prediction[0].element = "hex20": must be "hex8"'),
]  # fmt: skip


@pytest.mark.parametrize(("base", "right", "wrong", "said"), CASE_MISTAKES, ids=[case[2] for case in CASE_MISTAKES])
def test_a_mistake_in_a_case_file_is_shown_with_its_line(
    refusal: Refusal, at_home: Path, case_text: dict[str, str], base: str, right: str, wrong: str, said: str
) -> None:
    text = case_text[base]
    assert right in text
    (at_home / "my.toml").write_text(text.replace(right, wrong, 1))
    message = refusal("table1", "my.toml")
    wanted = ".*".join(map(re.escape, said.split(".*")))
    (line,) = (line for line in message.splitlines() if re.search(wanted, line))
    result = re.match(r"my\.toml:(\d+): ", line)
    assert result
    # The line of the mistake, or of the table that it is in.
    key = re.findall(r"[a-z_]+", line[result.end() :].split(":")[0].split(" = ")[0])[-1]
    assert key in text.replace(right, wrong, 1).splitlines()[int(result[1]) - 1]


@pytest.mark.parametrize(
    ("wrong", "remedy"),
    [
        ("blade.lenght", 'did you mean "blade.length"?'),
        ("length_ratio", 'did you mean "mesh.length_ratio"?'),
        ("model", 'write it as table.key, e.g. "blade.length"'),
        ("blade.kind", "; "),  # a word
        ("mesh.pads.band", "write it as table.key"),  # a plain blade has no pads
    ],
)
def test_a_tuned_number_that_the_case_does_not_have_is_refused(
    refusal: Refusal, at_home: Path, case_text: dict[str, str], wrong: str, remedy: str
) -> None:
    text = case_text["plain"].replace('"mesh.length_cap",', f'"{wrong}",')
    (at_home / "my.toml").write_text(text)
    line = text.splitlines().index(f'    "{wrong}",') + 1
    message = refusal("table1", "my.toml")
    assert message.startswith(f'my.toml:{line}: tuned[4] = "{wrong}": is not the name of a number of this case; ')
    assert remedy in message
    assert message.count("\n") == 1


def test_all_mistakes_of_a_file_are_shown_at_once(refusal: Refusal, at_home: Path, case_text: dict[str, str]) -> None:
    text = case_text["rig"].replace("drop_every = 6", "drop_every = 1").replace('"250.4 mm"', '"250.4 kg"')
    (at_home / "my.toml").write_text(text)
    lines = refusal("table1", "my.toml").splitlines()
    assert len(lines) == 2
    assert "blade.length" in lines[0]
    assert "root.drop_every" in lines[1]


@pytest.mark.parametrize("command", ["modes", "reduce"])
def test_modes_and_reduce_refuse_a_blade_case_as_the_mesh_study_does(
    refusal: Refusal, at_home: Path, case_text: dict[str, str], command: str
) -> None:
    text = case_text["blade"]
    (at_home / "my.toml").write_text(text.replace("along_contact = 6", "along_contact = 5"))
    assert re.match(
        r"my\.toml:\d+: structure\.mesh: station 4 of .* give the contact line", refusal(command, "my.toml")
    )
    (at_home / "my.toml").write_text(text.replace('length = "250.4 mm"', 'length = "-1 mm"'))
    assert re.match(
        r'my\.toml:\d+: structure\.blade\.length = "-1 mm": .* is not positive', refusal(command, "my.toml")
    )
    assert "no_such.toml: there is no such case file" in refusal(command, "no_such.toml")


@pytest.mark.parametrize("command", ["table1", "modes", "reduce"])
def test_an_output_folder_that_cannot_be_written_is_refused_first(refusal: Refusal, command: str) -> None:
    assert re.match(
        r"stickslip: the output folder /dev/null/x cannot be written \(.*\): name another one with --out\n$",
        refusal(command, "--out", "/dev/null/x"),
    )


def part() -> Mesh:
    """A bar in millimetres."""

    def shape(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return 10 * u, 8 * v, 60 * w

    mesh = mesh_blocks([Block(shape=shape, counts=(1, 1, 3), faces={"w0": "CLAMP"})], HEX8)
    foot = mesh.nodes("CLAMP")
    return replace(mesh, node_sets={"ONE": foot[:1], "TWO": foot[:2]})


#: A part of a mesh file: all that its case must say.
PART = """\
schema = 2
[structure]
kind = "part"
file = "part.inp"
length_unit = "mm"
[structure.material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
[[structure.support]]
on = ["CLAMP"]
[structure.reduction]
modes = 3
"""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--fix", "CLAMP"], "part.inp: the unit of its coordinates is not given: add, for example, --length-unit mm"),
        (["--fix", "CLAMP", "--length-unit", "milimeter"], '--length-unit "milimeter": unknown unit "milimeter"'),
        (["--fix", "CLAMP", "--length-unit", "kg"], '--length-unit "kg": "kg" makes it a mass, but a length is needed'),
        (["--length-unit", "mm"], "part.inp has no support: name a set with --fix (it has CLAMP, ONE, TWO), or give"),
        (["--length-unit", "mm", "--fix", "CLAMP", "--free"], "--free and --fix contradict each other: remove one"),
        (["--length-unit", "mm", "--fix", "CLAMPS"], "--fix CLAMPS: part.inp has no such set, it has CLAMP, ONE, TWO"),
        (["--length-unit", "mm", "--fix", "ONE"], "part.inp with --fix ONE: the supports leave the body free in rotat"),
        (["--length-unit", "mm", "--fix", "TWO"], "part.inp with --fix TWO: the supports leave the body free in rotat"),
        (
            ["--length-unit", "mm", "--free", "--n-modes", "0"],
            "--n-modes 0 is not a valid number of modes: give 1 or more",
        ),
        (
            ["--length-unit", "mm", "--free", "--n-modes", "99"],
            "99 modes were requested from a system with 48 degrees of f",
        ),
        (["--length-unit", "mm", "--free", "--film", "7"], "--film 7 is not one of the 6 modes: give 1 to 6"),
        (
            ["--length-unit", "mm", "--free", "--young", "1 mm"],
            '--young "1 mm": "mm" makes it a length, but a Young',
        ),
        (
            ["--length-unit", "mm", "--free", "--density", "7800 kg/mm^3"],
            '--density "7800 kg/mm^3": 7.8e+12 kg/m^3 is beyond any solid (0.1 to 25,000 kg/m^3); did you mean "7800 k',
        ),
        (
            ["--length-unit", "mm", "--free", "--young=-1 GPa"],
            "--young -1e+09 Pa must be positive and finite: steel has",
        ),
        (["--length-unit", "mm", "--free", "--poisson", "0.5"], "--poisson 0.5 must lie between -1 and 0.5: steel has"),
        (["--length-unit", "mm", "--free", "--density", "0 kg/m^3"], "--density 0 kg/m^3 must be positive and finite"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_a_mesh_file_does_not_say_must_be_said_and_make_sense(
    refusal: Refusal, at_home: Path, words: list[str], said: str
) -> None:
    write_mesh(part(), at_home / "part.inp")
    # Cells of eight nodes have a warning above it.
    *_, message = refusal("modes", "part.inp", *words).splitlines(keepends=True)
    assert message.startswith("stickslip: " + said)
    assert message.count("\n") == 1


@pytest.mark.parametrize("kind", ["blade", "rig", "plain", "coarse", "short rig", "part"])
def test_a_density_beyond_all_solids_is_refused_in_every_kind_of_case(
    refusal: Refusal, at_home: Path, case_text: dict[str, str], short_rig: str, kind: str
) -> None:
    texts = {**case_text, "short rig": short_rig, "part": PART}
    text, n = re.subn(r"^density = .*$", 'density = "7800 kg/mm^3"', texts[kind], flags=re.MULTILINE)
    assert n == 1
    (at_home / "my.toml").write_text(text)
    line = text[: text.index("7800 kg/mm^3")].count("\n") + 1
    command, table = ("table1", "") if "[[model]]" in text else ("reduce", "structure.")
    message = refusal(command, "my.toml")
    assert f"my.toml:{line}: {table}material.density" in message
    assert 'did you mean "7800 kg/m^3"?' in message


def test_options_for_mesh_files_are_refused_with_a_case_file(
    refusal: Refusal, at_home: Path, case_text: dict[str, str]
) -> None:
    (at_home / "my.toml").write_text(case_text["blade"])
    for words in (["--free"], ["--fix", "CLAMP"], ["--length-unit", "mm"]):
        assert "are for mesh files, but my.toml is a case file" in refusal("modes", "my.toml", *words)


def spoilt(text: str, how: str) -> str:
    """A deck with one mistake."""
    if how == "unsupported cell":
        return text.replace("C3D8", "C3D6")
    if how == "cut short":
        return text[: text.index("*ELEMENT") + 40]
    # Two opposite corners of the first cell change places.
    first = re.search(r"^1, *(\d+), *(\d+), *(\d+), *(\d+),", text[text.index("*ELEMENT") :], re.MULTILINE)
    assert first
    a, b, c, d = first.groups()
    return text.replace(first[0], f"1, {c}, {b}, {a}, {d},")


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("unsupported cell", r"part\.inp.*C3D6"),
        ("inverted cell", r"part\.inp, hexahedron cells.*1 of 3 cells inverted or collapsed \(cell 1;.*: remesh that"),
        ("cut short", r"part\.inp"),
    ],
)
def test_a_mesh_file_that_is_no_sound_mesh_is_refused_by_name(
    refusal: Refusal, at_home: Path, how: str, said: str
) -> None:
    write_mesh(part(), at_home / "part.inp")
    (at_home / "part.inp").write_text(spoilt((at_home / "part.inp").read_text(), how))
    message = refusal("modes", "part.inp", "--length-unit", "mm", "--free")
    assert re.search(said, message)
    assert message.count("\n") == 1


@pytest.mark.parametrize("name", ["missing.inp", "part.stl"])
def test_a_mesh_file_that_is_none_is_refused_by_name(refusal: Refusal, name: str) -> None:
    assert f"mesh file {name} " in refusal("modes", name, "--length-unit", "mm", "--free")
