"""A case file gives its values in SI, or all its mistakes at once with file and line."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field

from casefile.errors import CaseError
from casefile.quantity import Count, Length, Pressure, Ratio
from casefile.table import CaseModel, load_case, located
from geometry.errors import GeometryError


class BladeTable(CaseModel):
    length: Annotated[Length, Field(gt=0)]
    root_height: Length = 0.03
    modulus: Pressure = 210e9


class MeshTable(CaseModel):
    element: Literal["hex8", "hex20"]
    layers: Count = 4
    name: str = ""


class StudyCase(CaseModel):
    blade: BladeTable
    mesh: list[MeshTable] = Field(default=[])
    damping: Ratio = 0.001


@dataclass(frozen=True, kw_only=True)
class Solid:
    length: float
    root_height: float

    def __post_init__(self) -> None:
        if self.root_height > self.length:
            raise GeometryError(f"root height {self.root_height} m exceeds length {self.length} m: shorten the root")


SOUND = """\
schema = 2
damping = "0.2 %"

[blade]
length = "250 mm"  # a comment
root_height = "30 mm"

[[mesh]]
element = "hex8"

[[mesh]]
element = "hex20"
layers = 2
"""


def written(folder: Path, text: str | bytes) -> Path:
    file = folder / "my.toml"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return file


def complaints(folder: Path, text: str | bytes) -> list[str]:
    """Return the problems of a file, without the folder's name."""
    with pytest.raises(CaseError) as caught:
        load_case(written(folder, text), StudyCase)
    return [str(problem).removeprefix(f"{folder}/") for problem in caught.value.problems]


def test_a_sound_file_gives_si_values(tmp_path: Path) -> None:
    case = load_case(written(tmp_path, SOUND), StudyCase)
    assert (case.blade.length, case.blade.root_height, case.damping) == (0.25, 0.03, 0.002)
    assert [(mesh.element, mesh.layers) for mesh in case.mesh] == [("hex8", 4), ("hex20", 2)]


def test_a_text_that_must_not_be_empty_is_told_without_the_words_of_pydantic(tmp_path: Path) -> None:
    class FileCase(CaseModel):
        file: Annotated[str, Field(min_length=1)]

    with pytest.raises(CaseError, match=r'my\.toml:2: file = "": must not be empty'):
        load_case(written(tmp_path, 'schema = 2\nfile = ""\n'), FileCase)


def test_windows_line_ends_and_a_byte_order_mark_change_nothing(tmp_path: Path) -> None:
    case = load_case(written(tmp_path, "\ufeff" + SOUND.replace("\n", "\r\n")), StudyCase)
    assert case.blade.length == 0.25


def test_all_mistakes_are_told_at_once_each_with_its_line(tmp_path: Path) -> None:
    text = """\
schema = 2
dampling = 0.1
[blade]
lenght = "250 mm"
root_height = "30 kg"
modulus = 210
[[mesh]]
element = "hex8"
layers = 0
[[mesh]]
layers = "2"
[[mesh]]
element = "hxe20"
[blde]
x = 1
"""
    assert complaints(tmp_path, text) == [
        'my.toml:2: dampling: unknown key; did you mean "damping"?',
        'my.toml:3: blade.length is missing; add length = "250 mm"',
        'my.toml:4: blade.lenght: unknown key; did you mean "length"?',
        'my.toml:5: blade.root_height = "30 kg": "kg" makes it a mass, but a length is needed, e.g. "250 mm"',
        'my.toml:6: blade.modulus = 210: give a unit, e.g. "210 GPa"',
        "my.toml:9: mesh[0].layers = 0: must be greater than or equal to 1",
        "my.toml:10: mesh[1].element is missing; add it",
        'my.toml:11: mesh[1].layers = "2": must be a whole number, without quotes',
        'my.toml:13: mesh[2].element = "hxe20": must be "hex8" or "hex20"; did you mean "hex20"?',
        'my.toml:14: blde: unknown table; did you mean "blade"?',
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", 'my.toml:1: schema is missing; write "schema = 2" as the first line'),
        ("schema = 3\nnew = 1", "my.toml:1: schema = 3: a later format of case files"),
        (
            "schema = 1\nnew = 1",
            'my.toml:1: schema = 1: this earlier format of case files is no longer read: write "schema = 2", ',
        ),
        ('\nschema = "2"', 'my.toml:2: schema = "2": unknown format of case files'),
        ("schema = true", "my.toml:1: schema = true: unknown format of case files"),
        ("schema = 2", "my.toml:1: table [blade] is missing; add it"),
        ("schema = 2\nblade = 3", "my.toml:2: blade = 3: must be a table; write [blade]"),
        ('schema = 2\nmesh = 3\nblade.length = "1 m"', "my.toml:2: mesh = 3: must be a list of tables; write [[mesh]]"),
        ('schema = 2\n[blade]\nlength = "-1 mm"', 'my.toml:3: blade.length = "-1 mm": must be greater than 0 m'),
        ("schema = 2\n[blade]\nlength = 250 mm", "my.toml:3: this is not valid TOML: expected newline"),
        ("schema = 2\nx = [", "my.toml:2: this is not valid TOML"),
        ("schema = 2\n[blade]\n[blade]", "my.toml:3: this is not valid TOML: cannot declare ('blade',) twice"),
        (b"schema = 2\n# caf\xe9", "my.toml:2: byte 0xe9 is not UTF-8; save the file as UTF-8"),
        ("x = " + "[" * 5000, "my.toml: its brackets are nested too deeply"),
    ],
)
def test_a_file_of_the_wrong_form_is_refused_with_the_remedy(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert complaints(tmp_path, text)[0].startswith(expected)


def test_a_file_that_is_not_there_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"nowhere\.toml: there is no such case file"):
        load_case(tmp_path / "nowhere.toml", StudyCase)
    with pytest.raises(CaseError, match="this is a folder"):
        load_case(tmp_path, StudyCase)


def test_an_error_of_the_geometry_shows_the_key_and_line_that_it_speaks_of(tmp_path: Path) -> None:
    text = 'schema = 2\n[blade]\nlength = "20 mm"\nroot_height = "30 mm"'
    case = load_case(written(tmp_path, text), StudyCase)
    with (
        pytest.raises(CaseError, match=r'my\.toml:4: blade\.root_height = "30 mm": root height 0\.03 m exceeds length'),
        located(case, "blade"),
    ):
        Solid(length=case.blade.length, root_height=case.blade.root_height)


@pytest.mark.parametrize(
    ("message", "line"),
    [
        ("length 0.02 m is below root height 0.03 m", 3),
        ("Root_height 0.03 m exceeds length 0.02 m", 4),
        ("wavelength of the root height", 4),
    ],
)
def test_of_several_keys_in_a_message_the_first_whole_word_is_shown(tmp_path: Path, message: str, line: int) -> None:
    text = 'schema = 2\n[blade]\nlength = "20 mm"\nroot_height = "30 mm"'
    case = load_case(written(tmp_path, text), StudyCase)
    with pytest.raises(CaseError, match=rf"my\.toml:{line}: blade\."), located(case, "blade"):
        raise GeometryError(message)


def test_an_error_that_names_no_key_of_the_file_shows_the_table(tmp_path: Path) -> None:
    case = load_case(written(tmp_path, SOUND), StudyCase)
    with pytest.raises(CaseError, match=r"my\.toml:4: blade: the solid is empty"), located(case, "blade"):
        raise GeometryError("the solid is empty")


def test_a_parameter_of_another_name_is_found_through_the_given_key(tmp_path: Path) -> None:
    case = load_case(written(tmp_path, SOUND), StudyCase)
    expected = r"my\.toml:13: mesh\[1\]\.layers = 2: n_layer 2 is odd"
    with pytest.raises(CaseError, match=expected), located(case, "mesh", 1, keys={"n_layer": "layers"}):
        raise GeometryError("n_layer 2 is odd")


def test_a_case_built_in_code_keeps_the_plain_error() -> None:
    case = StudyCase.model_validate({"blade": {"length": "1 m"}})
    with pytest.raises(GeometryError, match=r"^too thin$"), located(case, "blade"):
        raise GeometryError("too thin")
