"""What a campaign folder says, and what is wrong with one."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError

MANIFEST = """\
schema = 1
title = "Beam"
[convention]
time = "exp(+i omega t)"
amplitude = "peak"
[units]
level = "N"
frequency = "Hz"
[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
uncertainty = "0.5 %"
[[sensor]]
name = "mid"
quantity = "acceleration"
direction = "z"
coordinates = ["150 mm", "0 mm", "0 mm"]
[[sensor]]
name = "left_N"
quantity = "contact force"
line = "left"
component = "normal"
[[test]]
name = "stepped"
configuration = "jointed"
file = "stepped.csv"
[[test]]
name = "free"
configuration = "free"
file = "free.csv"
[held_out]
levels = [5.0]
repeats = [2]
"""
RUN = '[[run]]\nfile = "a.csv"\nlevel = 1.0\ncolumns = { frequency = "f", tip = "x" }\n'
HEADER = "test,order,repeat,sweep,level,frequency,sensor,harmonic,real,imag,unit"


def rows(test: str = "stepped", sensors: tuple[str, ...] = ("tip um 1", "mid m/s^2 1", "left_N N 0")) -> list[str]:
    """Two repeats of two levels at three frequencies; every value is different."""
    result = [HEADER]
    for order, (repeat, level) in enumerate([(1, 1.0), (1, 5.0), (2, 1.0), (2, 5.0)], start=1):
        for frequency in (99.5, 100.0, 100.5):
            for number, sensor in enumerate(sensors):
                name, unit, harmonic = sensor.split()
                real = round(level * (frequency - 90 + number) + 0.01 * repeat, 3)
                imag = "0" if harmonic == "0" else str(-1.5 * level - 0.1 * (frequency - 99.5) - 0.01 * repeat)
                result.append(f"{test},{order},{repeat},up,{level},{frequency},{name},{harmonic},{real},{imag},{unit}")
    return result


def campaign_folder(folder: Path, manifest: str = MANIFEST, stepped: list[str] | None = None) -> Path:
    (folder / "campaign.toml").write_text(manifest, encoding="utf-8")
    (folder / "stepped.csv").write_text("\n".join(stepped or rows()) + "\n", encoding="utf-8")
    (folder / "free.csv").write_text("\n".join(rows("free", ("tip um 1", "mid m/s^2 1"))) + "\n", encoding="utf-8")
    return folder


def with_row(number: int, **changes: str) -> list[str]:
    """A table with some fields of one of its rows, counted from 1 below the header, changed."""
    table = rows()
    fields = dict(zip(HEADER.split(","), table[number].split(","), strict=True)) | changes
    table[number] = ",".join(fields.values())
    return table


def first_tip(campaign: Campaign) -> complex:
    table = campaign.measurement
    at = (table.test == 0) & (table.sensor == 0) & (table.level == table.level.min()) & (table.repeat == 1)
    return complex(table.value[at][0])


def test_values_arrive_in_si(tmp_path: Path) -> None:
    campaign = read_campaign(campaign_folder(tmp_path))
    assert first_tip(campaign) == pytest.approx((9.51 - 1.51j) * 1e-6, rel=1e-12)  # micrometres; round-off
    assert [sensor.name for sensor in campaign.sensors] == ["tip", "mid", "left_N"]
    assert campaign.sensors[0].uncertainty == pytest.approx(0.005)
    assert campaign.sensors[1].coordinates == pytest.approx([0.15, 0, 0])
    assert (campaign.sensors[2].line, campaign.sensors[2].component) == ("left", "normal")
    assert campaign.held_out.levels == (5.0,)
    assert campaign.held_out.repeats == (2,)
    assert campaign.suspicions == ()


def test_the_other_sign_of_time_is_the_conjugate(tmp_path: Path) -> None:
    campaign = read_campaign(campaign_folder(tmp_path, MANIFEST.replace("exp(+i", "exp(-i")))
    assert first_tip(campaign) == pytest.approx((9.51 + 1.51j) * 1e-6, rel=1e-12)  # round-off


@pytest.mark.parametrize(("word", "peak"), [("rms", np.sqrt(2)), ("peak to peak", 0.5)])
def test_an_amplitude_becomes_its_peak_but_a_mean_stays(tmp_path: Path, word: str, peak: float) -> None:
    campaign = read_campaign(campaign_folder(tmp_path, MANIFEST.replace('"peak"', f'"{word}"')))
    assert first_tip(campaign) == pytest.approx(peak * (9.51 - 1.51j) * 1e-6, rel=1e-12)  # round-off
    table = campaign.measurement
    assert table.value[table.harmonic == 0][0] == pytest.approx(11.51, rel=1e-12)
    assert campaign.levels == pytest.approx([peak, 5 * peak])
    assert campaign.held_out.rows(table).sum() > 0


def test_an_angular_frequency_becomes_hertz(tmp_path: Path) -> None:
    campaign = read_campaign(campaign_folder(tmp_path, MANIFEST.replace('"Hz"', '"rad/s"')))
    assert campaign.measurement.frequency.max() == pytest.approx(100.5 / (2 * np.pi), rel=1e-12)  # round-off


def test_the_order_of_rows_and_of_columns_does_not_matter(tmp_path: Path) -> None:
    first = read_campaign(campaign_folder(tmp_path)).measurement
    header, *body = (",".join(reversed(row.split(","))) for row in rows())
    second = read_campaign(campaign_folder(tmp_path, stepped=[header, "", *reversed(body)])).measurement
    for name in ("test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "value"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_a_byte_order_mark_and_blanks_do_not_matter(tmp_path: Path) -> None:
    table = [row.replace(",", " , ") for row in rows()]
    campaign = read_campaign(campaign_folder(tmp_path, stepped=["\ufeff" + table[0], *table[1:]]))
    assert first_tip(campaign) == pytest.approx((9.51 - 1.51j) * 1e-6, rel=1e-12)  # round-off


def test_tables_are_read_only(tmp_path: Path) -> None:
    campaign = read_campaign(campaign_folder(tmp_path))
    with pytest.raises(ValueError, match="read-only"):
        campaign.measurement.value[0] = 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unit": "ym2"}, r'stepped\.csv:2: unit = "ym2" for sensor "tip".*unknown unit "ym2"'),
        ({"unit": "Um"}, r'unknown unit "Um"; did you mean "um"\?'),
        ({"unit": "N"}, r'unit = "N" for sensor "tip", which measures a displacement: .*such as "m" is needed'),
        ({"unit": "mil"}, r'unit = "mil" .*another quantity.* write thou'),
        ({"unit": ""}, r'stepped\.csv:2: unit is missing; write "m"'),
        ({"sensor": "tipp"}, r'stepped\.csv:2: sensor = "tipp" is not a sensor.*did you mean "tip"\?'),
        ({"test": "free"}, r'stepped\.csv:2: test = "free" is not a test of campaign\.toml for this file'),
        ({"sweep": "rising"}, r'sweep = "rising" is not a sweep: give one of up, down, none'),
        ({"real": "nan"}, r'stepped\.csv:2: real = "nan" is not finite; leave out'),
        ({"imag": "inf"}, r'imag = "inf" is not finite'),
        ({"imag": ""}, r'imag = "" is not a number; leave out what was not measured'),
        ({"real": "1.2.3"}, r'stepped\.csv:2: real = "1\.2\.3" is not a number'),
        ({"real": '"9,51"'}, r'real = "9,51" is not a number; write a decimal point, not a comma'),
        ({"real": "9,51"}, r"stepped\.csv:2: has 12 fields, the header has 11: are its decimals commas"),
        ({"level": "-1"}, r"stepped\.csv:2: level = -1: must be positive"),
        ({"frequency": "0"}, r"stepped\.csv:2: frequency = 0: must be positive"),
        ({"repeat": "1.5"}, r'stepped\.csv:2: repeat = "1\.5" must be a whole number from 0 on'),
        ({"harmonic": "-1"}, r'harmonic = "-1" must be a whole number from 0 on'),
        ({"harmonic": "0"}, r"imag = -1\.51.*: a mean \(harmonic 0\) has no imaginary part"),
    ],
)
def test_a_bad_field_is_named_with_its_line(tmp_path: Path, changes: dict[str, str], message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        read_campaign(campaign_folder(tmp_path, stepped=with_row(1, **changes)))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (HEADER.replace("real,imag", "amplitude,phase"), r'column "amplitude" is polar: give columns real and imag'),
        (HEADER.replace("real", "re"), r'there is no column "real"; the header must be test,order'),
        (HEADER.replace(",", ";"), r"stepped\.csv:1: its fields are separated by semicolons; save it with commas"),
        (HEADER.replace("order", "repeat"), r'two columns are called "repeat"'),
        (HEADER.replace("order", "orders"), r'there is no column "order"'),
    ],
)
def test_a_wrong_header_is_refused(tmp_path: Path, header: str, message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        read_campaign(campaign_folder(tmp_path, stepped=[header, *rows()[1:]]))


@pytest.mark.parametrize("frequency", ["99.5", "99.5000001"])
def test_a_row_given_twice_is_refused_with_both_lines(tmp_path: Path, frequency: str) -> None:
    again = rows()[1].replace("9.51", "9.52").replace("99.5", frequency)
    with pytest.raises(CampaignError, match=r"stepped\.csv:38: measures the same as line 2 .*number its repeat"):
        read_campaign(campaign_folder(tmp_path, stepped=[*rows(), again]))


def test_a_sensor_without_rows_is_refused(tmp_path: Path) -> None:
    stepped = [row for row in rows() if "left_N" not in row]
    with pytest.raises(CampaignError, match=r'sensor "left_N" has no rows in stepped\.csv, free\.csv; add them'):
        read_campaign(campaign_folder(tmp_path, stepped=stepped))


def test_a_test_without_rows_is_refused(tmp_path: Path) -> None:
    manifest = MANIFEST + '[[test]]\nname = "again"\nconfiguration = "jointed"\nfile = "stepped.csv"\n'
    with pytest.raises(CampaignError, match=r'stepped\.csv: has no rows of test "again"'):
        read_campaign(campaign_folder(tmp_path, manifest))


def test_a_contact_force_of_a_free_structure_is_refused(tmp_path: Path) -> None:
    manifest = MANIFEST.replace('"jointed"', '"free"')
    with pytest.raises(CampaignError, match=r"stepped\.csv:4: sensor = left_N: measures a contact, but the test is of"):
        read_campaign(campaign_folder(tmp_path, manifest))


def test_a_dead_channel_is_refused_with_its_reading(tmp_path: Path) -> None:
    dead = [row if ",tip," not in row else ",".join([*row.split(",")[:8], "0.25", "0", "um"]) for row in rows()]
    with pytest.raises(CampaignError, match=r'"tip" reads 2\.5e-07\+0j m at all 6 points.*a dead channel'):
        read_campaign(campaign_folder(tmp_path, stepped=dead))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema = 1\n", "", r"schema: is missing; add schema = 1"),
        ("schema = 1", "schema = 2", r"schema = 2: this version of stickslip reads schema = 1"),
        ("exp(+i omega t)", "exp(jwt)", r'convention\.time = "exp\(jwt\)": must be one of'),
        ('amplitude = "peak"', 'amplitude = "pk"', r'convention\.amplitude = "pk": must be.*did you mean "peak"'),
        ('level = "N"', 'level = "kg"', r'units\.level = "kg": "kg" is a unit of another quantity.*such as "N"'),
        ('level = "N"\n', "", r'units\.level: is missing; add level = "N"'),
        ('"displacement"', '"displacment"', r'sensor\[1\]\.quantity = "displacment".*did you mean "displacement"\?'),
        ('"0 mm", "0 mm"]', '"0 mm"]', r"sensor\[2\]\.coordinates.*give three"),
        ('"150 mm"', '"150"', r"sensor\[2\]\.coordinates.*give a unit"),
        ('"150 mm"', '"1,5 mm"', r"decimal point, not a comma"),
        (
            'place = "tip"\n',
            'place = "tip"\ncoordinates = ["1 m", "0 m", "0 m"]\n',
            r'sensor\[1\]\.place: give place = "\.\.\." or coordinates',
        ),
        ('"0.5 %"', '"0.5 mm"', r'sensor\[1\]\.uncertainty = "0\.5 mm": .*a bare number is needed'),
        ('name = "mid"', 'name = "tip"', r'sensor\[2\]\.name = "tip": two have this name; give each its own name'),
        ('name = "mid"', 'name = ["mid"]', r"sensor\[2\]\.name = \['mid'\]: must be text in quotes"),
        ('name = "mid"', "name = { of = 1 }", r"sensor\[2\]\.name = \{'of': 1\}: must be text in quotes"),
        ('name = "stepped"', 'name = ["stepped"]', r"test\[1\]\.name = \['stepped'\]: must be text in quotes"),
        ("[held_out]", '[[record]]\nname = []\nfile = "a.csv"\n[held_out]', r"record\[1\]\.name = \[\]: must be text"),
        ("[held_out]", f'{RUN}test = ["stepped"]\n[held_out]', r"run\[1\]\.test = \['stepped'\]: must be text"),
        ("[held_out]", f"{RUN}test = {{ of = 1 }}\n[held_out]", r"run\[1\]\.test = \{'of': 1\}: must be text"),
        ("direction", "direktion", r'sensor\[1\]\.direktion.*did you mean "?direction'),
        ('file = "free.csv"', 'file = "fre.csv"', r'fre\.csv: there is no such file in ".*"; correct its name'),
        ("levels = [5.0]", "levels = [4.0]", r"held_out\.levels = 4 was not measured; hold out some of 1, 5"),
        ("repeats = [2]", "repeats = [7]", r"held_out\.repeats = 7 was not measured; hold out some of 1, 2"),
        ("repeats = [2]", "repeats = [1, 2]", r"held_out holds out everything"),
        ("[held_out]", "[heldout]", r'heldout.*unknown key; did you mean "held_out"\?'),
        ("title =", "title", r"campaign\.toml:2: this is not valid TOML: expected '='"),
    ],
)
def test_a_bad_manifest_is_refused_with_its_key(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in MANIFEST
    with pytest.raises(CampaignError, match=message) as caught:
        read_campaign(campaign_folder(tmp_path, MANIFEST.replace(old, new, 1)))
    assert "\n" not in str(caught.value)


def test_mistakes_of_a_manifest_are_told_together(tmp_path: Path) -> None:
    wrong = {
        'amplitude = "peak"': 'amplitude = "pk"', 'level = "N"': 'level = "kg"', '"displacement"': '"displacment"',
        '"150 mm"': '"150"', 'configuration = "free"': 'configuration = "fre"', "title": "titel",
    }  # fmt: skip
    manifest = MANIFEST
    for old, new in wrong.items():
        manifest = manifest.replace(old, new, 1)
    with pytest.raises(CampaignError) as caught:
        read_campaign(campaign_folder(tmp_path, manifest))
    told = str(caught.value).split("\n")
    keys = ("convention.amplitude", "units.level", "sensor[1].quantity", "sensor[2].coor", "test[2].config", "titel")
    assert [key in line for key, line in zip(keys, told, strict=True)] == [True] * len(keys)


def test_mistakes_of_several_tables_are_told_together(tmp_path: Path) -> None:
    folder = campaign_folder(tmp_path, stepped=with_row(3, real="1,5".replace(",", ";")))
    (folder / "free.csv").unlink()
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder)
    first, second = str(caught.value).split("\n")
    assert first.startswith('stepped.csv:4: real = "1;5" is not a number')
    assert second.startswith("free.csv: there is no such file")


def test_dead_channels_and_what_is_not_measured_are_told_together(tmp_path: Path) -> None:
    dead = [row if ",tip," not in row else ",".join([*row.split(",")[:8], "0.25", "0", "um"]) for row in rows()]
    manifest = MANIFEST.replace("repeats = [2]", "repeats = [7]").replace(
        "[[test]]", '[[sensor]]\nname = "top"\nquantity = "displacement"\ndirection = "z"\nplace = "top"\n[[test]]', 1
    )
    with pytest.raises(CampaignError) as caught:
        read_campaign(campaign_folder(tmp_path, manifest, dead))
    told = str(caught.value).split("\n")
    assert len(told) == 3
    assert '"tip" reads 2.5e-07+0j m' in told[0]
    assert 'sensor "top" has no rows' in told[1]
    assert "held_out.repeats = 7 was not measured" in told[2]


def test_a_folder_without_manifest_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"there is no campaign\.toml in .*give the folder of a campaign$"):
        read_campaign(tmp_path)
    (tmp_path / "sweep.csv").write_text("f [Hz],x [m]\n")
    with pytest.raises(CampaignError, match=r"or draft it by: stickslip campaign new "):
        read_campaign(tmp_path)


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    folder = campaign_folder(tmp_path)
    (folder / "stepped.csv").write_bytes(b"\x00\x01\xff\xfe" * 20)
    with pytest.raises(CampaignError, match=r"stepped\.csv: is not text in UTF-8; save it as CSV"):
        read_campaign(folder)
