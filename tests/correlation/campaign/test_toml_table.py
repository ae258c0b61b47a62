"""Mistakes of a manifest: where they stand, and advice that is accepted there."""

import re
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.toml_table import TomlTable
from correlation.errors import CampaignError

MANIFEST = """\
schema = 1
[convention]
time = "exp(+i omega t)"
amplitude = "peak"
[units]
level = "{level}"
frequency = "Hz"
[drive]
quantity = "{drive}"
[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
[[test]]
name = "stepped"
configuration = "jointed"
[[run]]
test = "stepped"
file = "stepped.csv"
level = 1.0
columns = { frequency = "f [Hz]", tip = "x [m]" }
[[loop]]
name = "rubbed"
file = "loop.csv"
line = "A"
sensor = "tip"
level = "5 {level}"
frequency = "1 Hz"
columns = { displacement = "x [m]", force = "F [N]" }
[[mode]]
name = "first"
configuration = "free"
frequency = "100 Hz"
"""
FORCE, BASE = ("force", "N"), ("base acceleration", "m/s^2")


def write(folder: Path, lines: list[str], drive: tuple[str, str] = FORCE) -> Path:
    text = "\n".join(lines).replace("{drive}", drive[0]).replace("{level}", drive[1])
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    (folder / "stepped.csv").write_text("f [Hz],x [m]\n10,1e-6\n11,2e-6\n", encoding="utf-8")
    phase = np.linspace(0, 8 * np.pi, 400)
    rows = "".join(f"{x},{f}\n" for x, f in zip(np.sin(phase), np.sin(phase + 0.5), strict=True))
    (folder / "loop.csv").write_text(f"x [m],F [N]\n{rows}", encoding="utf-8")
    return folder


#: Keys whose advice is a value. That of names, tables and lists of names is a form to fill in.
KEYS = (
    "schema",
    "time",
    "amplitude",
    'level = "',
    "frequency =",
    'quantity = "displacement',
    "configuration",
)


@pytest.mark.parametrize("drive", [FORCE, BASE], ids=["force", "base"])
@pytest.mark.parametrize("number", [n for n, line in enumerate(MANIFEST.splitlines()) if line.startswith(KEYS)])
def test_a_word_number_or_quantity_that_is_advised_for_a_missing_key_is_accepted(
    tmp_path: Path, drive: tuple[str, str], number: int
) -> None:
    lines = MANIFEST.splitlines()
    del lines[number]
    with pytest.raises(CampaignError) as caught:
        read_campaign(write(tmp_path, lines, drive))
    advice = re.search(r"is missing; add (\w+ = .+?)(?: or |$)", str(caught.value))
    assert advice is not None, str(caught.value)
    lines.insert(number, advice[1])
    read_campaign(write(tmp_path, lines, drive))


@pytest.mark.parametrize(("example", "advice"), [({}, '"..."'), ({"example": "5 s"}, '"5 s"')])
def test_a_missing_key_is_advised_an_example_or_a_blank(example: dict[str, str], advice: str) -> None:
    with pytest.raises(CampaignError, match=rf"window: is missing; add window = {re.escape(advice)}$"):
        TomlTable(file="campaign.toml", values={}).converted("window", str, **example)


def mistakes(folder: Path, manifest: str) -> list[str]:
    with pytest.raises(CampaignError) as caught:
        read_campaign(write(folder, manifest.splitlines()))
    return str(caught.value).split("\n")


@pytest.mark.parametrize("name", ["", "name = 1\n"])
def test_what_names_a_sensor_or_a_test_without_a_name_is_no_second_mistake(tmp_path: Path, name: str) -> None:
    for table, old in (("sensor", 'name = "tip"\n'), ("test", 'name = "stepped"\n')):
        (only,) = mistakes(tmp_path, MANIFEST.replace(old, name, 1))
        assert f"{table}[1].name" in only


def test_mistakes_of_sensors_and_of_load_cells_are_told_together(tmp_path: Path) -> None:
    cells = """\
[[sensor]]
name = "R3"
quantity = "loadcell"
[[sensor]]
name = "R4"
quantity = "load cell"
[[sensor]]
name = "A_N"
quantity = "contact force"
line = "A"
component = "normal"
[[load_cells]]
cells = ["R3", "R4"]
tangential = "A_T"
normal = "A_N"
taper = "8 deg"
"""
    first, second = mistakes(tmp_path, MANIFEST + cells)
    assert 'sensor[2].quantity = "loadcell"' in first
    # Of R3 nothing is known, and A_T is no sensor at all.
    assert 'load_cells[1].tangential = "A_T"' in second
    force = '[[sensor]]\nname = "A_T"\nquantity = "contact force"\nline = "A"\ncomponent = "tangential"\n'
    first, second = mistakes(tmp_path, MANIFEST + force + cells)
    assert "load_cells[1].arm: is missing" in second


def test_a_key_under_another_name_is_to_be_renamed(tmp_path: Path) -> None:
    lines = MANIFEST.replace('quantity = "disp', 'quantitiy = "disp').splitlines()
    with pytest.raises(CampaignError, match=r'quantity: is missing; found "quantitiy": call it quantity$'):
        read_campaign(write(tmp_path, lines))


@pytest.mark.parametrize(
    ("old", "new", "words", "key"),
    [
        ('direction = "z"', 'direction = "w"', "direction", r"sensor\[1\]\.direction"),
        (
            'direction = "z"\nplace = "tip"',
            'coordinates = ["1 m", "0 m", "0 m"]',
            "[[sensor]]",
            r"sensor\[1\]\.direction",
        ),
        ("level = 1.0", "level = -1.0", "-1.0", r"run\[1\]\.level"),
        ('"f [Hz]"', "7", "frequency = 7", r"run\[1\]\.columns\.frequency"),
        (
            'tip = "x [m]"',
            'tip = [{ column = "x [m]" },\n{ colum = "x [m]" }]',
            "colum =",
            r"run\[1\]\.columns\.tip\[2\]",
        ),
        ('"100 Hz"', '"100 kg"', "kg", r"mode\[1\]\.frequency"),
        ('"1 Hz"\n', '"1 Hz"\nplaces = "tip"\n', "places", r"loop\[1\]\.places"),
        ("schema = 1", "# first\n\nscheme = 1", "# first", "schema"),
    ],
)
def test_a_mistake_has_the_line_of_its_key_or_else_of_its_table(
    tmp_path: Path, old: str, new: str, words: str, key: str
) -> None:
    lines = MANIFEST.replace(old, new, 1).splitlines()
    line = 1 + next(number for number, item in enumerate(lines) if words in item)
    with pytest.raises(CampaignError, match=rf"^campaign\.toml:{line}: {key}"):
        read_campaign(write(tmp_path, lines))
