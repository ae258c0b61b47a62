"""A campaign that is written and read again is the same; time records in their CSV dialect."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.time_record import TimeRecord, make_record_of_columns
from correlation.campaign.write_campaign import write_campaign
from correlation.data_type.mode import MeasuredMode
from correlation.errors import CampaignError
from correlation.file.read_file import read_file

SENSORS = (
    MeasuredSensor(name="tip, upper", quantity="acceleration", direction="z", place='the "tip"', uncertainty=0.005),
    MeasuredSensor(name="flank", quantity="displacement", direction="ry", coordinates=np.array([0.1, 1 / 3, -0.0])),
    MeasuredSensor(name="left_T", quantity="contact force", line="left", component="tangential"),
)


def made() -> Campaign:
    rng = np.random.default_rng(1)
    k = 96
    test, sensor = np.repeat([0, 1], k // 2), np.arange(k) % 3
    sensor[test == 1] %= 2  # no contact where the structure is free
    value = rng.normal(size=k) + 1j * rng.normal(size=k)
    harmonic = np.where(sensor == 2, np.arange(k) // 3 % 2, 1)
    return Campaign(
        title='A beam, "two lines", µ = 0.5',
        folder=Path(),
        sensors=SENSORS,
        tests=(Test(name="stepped"), Test(name="free/unloaded", configuration="free")),
        measurement=Measurement(
            test=test,
            order=np.arange(k),
            repeat=1 + np.arange(k) % 2,
            sweep=rng.integers(-1, 2, k),
            level=rng.choice([1.0, 1 / 3], k),
            # Apart by more than rounding: nearer ones would be one frequency.
            frequency=100 + (rng.permutation(k) + rng.random(k) / 2) / k,
            sensor=sensor,
            harmonic=harmonic,
            value=np.where(harmonic == 0, value.real, value),
        ),
        held_out=HeldOut(levels=(1 / 3,), repeats=(2,)),
        records=(
            TimeRecord(
                name="ring-down",
                time=np.arange(5) * 1e-3,
                channels=("tip, upper", "flank"),
                units=("m/s^2", "rad"),
                values=rng.normal(size=(2, 5)),
                held_out=True,
            ),
            TimeRecord(
                name="multisine",
                time=np.arange(5) * 1e-3,
                channels=("shaker", "flank"),
                units=("V", "V"),
                values=rng.normal(size=(2, 5)),
                force="shaker",
            ),
        ),
    )


def test_reading_what_was_written_changes_no_digit(tmp_path: Path) -> None:
    first = made()
    write_campaign(first, tmp_path / "one")
    second = read_campaign(tmp_path / "one")
    write_campaign(second, tmp_path / "two")
    # The table is sorted by reading: a second turn changes nothing, not even a byte.
    for file in sorted((tmp_path / "one").iterdir()):
        again = (tmp_path / "two" / file.name).read_text(encoding="utf-8")
        assert sorted(again.splitlines()) == sorted(file.read_text(encoding="utf-8").splitlines())
    assert np.array_equal(np.sort_complex(first.measurement.value), np.sort_complex(second.measurement.value))
    assert (second.title, second.held_out.levels, second.held_out.repeats) == (first.title, (1 / 3,), (2,))
    assert [test.configuration for test in second.tests] == ["jointed", "free"]
    for before, after in zip(first.sensors, second.sensors, strict=True):
        for name in ("name", "quantity", "direction", "place", "line", "component", "uncertainty", "unit"):
            assert getattr(before, name) == getattr(after, name)
    np.testing.assert_array_equal(first.sensors[1].coordinates, second.sensors[1].coordinates)  # type: ignore[arg-type]
    for old, new in zip(first.records, second.records, strict=True):
        assert (old.name, old.channels, old.units, old.force, old.held_out) == (
            new.name,
            new.channels,
            new.units,
            new.force,
            new.held_out,
        )
        np.testing.assert_array_equal(old.time, new.time)
        np.testing.assert_array_equal(old.values, new.values)


def test_time_records_alone_make_a_campaign(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(
        'schema = 1\n[[sensor]]\nname = "y"\nquantity = "displacement"\ndirection = "z"\nplace = "mass"\n'
        '[[record]]\nname = "train"\nfile = "train.csv"\nforce = "u"\nunits = { u = "V", y = "mV" }\n'
    )
    (tmp_path / "train.csv").write_text("time,u,y\n0.0,1.0,2.0\n0.1,0.5,3.0\n")
    campaign = read_campaign(tmp_path)
    assert len(campaign.measurement) == 0
    assert campaign.records[0].force == "u"
    assert campaign.records[0].channel("y") == pytest.approx([2e-3, 3e-3])


SIGNED = (
    'schema = 1\n[[sensor]]\nname = "y"\nquantity = "acceleration"\ndirection = "z"\nplace = "mass"\n'
    '[[record]]\nname = "train"\nfile = "train.csv"\nforce = "u"\n[record.units]\ntime = {time}\nu = "N"\ny = {y}\n'
)


def test_a_channel_of_a_record_that_is_mounted_the_other_way_round_is_turned(tmp_path: Path) -> None:
    manifest = SIGNED.format(time='{ unit = "ms" }', y='{ unit = "g_n", sign = -1 }')
    (tmp_path / "campaign.toml").write_text(manifest)
    (tmp_path / "train.csv").write_text("time,u,y\n0,1.0,2.0\n1,0.5,-3.0\n")
    (read,) = read_campaign(tmp_path).records
    assert read.time == pytest.approx([0, 1e-3])
    assert read.channel("u") == pytest.approx([1.0, 0.5])
    # 1 g_n is 9.80665 m/s^2 by definition.
    assert read.channel("y") == pytest.approx([-2 * 9.80665, 3 * 9.80665])


@pytest.mark.parametrize(
    ("time", "y", "message"),
    [
        ('"s"', '{ unit = "g_n", sign = 2 }', r"record\[1\]\.units\.y\.sign = 2: must be 1 or -1"),
        ('"s"', "{ sign = -1 }", r"record\[1\]\.units\.y\.unit: is missing"),
        ('"s"', '{ unit = "g_n", phase = 1 }', r"record\[1\]\.units\.y\.phase = 1: unknown key"),
        ('"s"', "1.0", r"record\[1\]\.units.*the unit of \"y\" must be text"),
        ('{ unit = "s", sign = -1 }', '"g_n"', r"record\[1\]\.units\.time\.sign = -1: unknown key"),
    ],
)
def test_a_bad_sign_of_a_record_is_refused(tmp_path: Path, time: str, y: str, message: str) -> None:
    (tmp_path / "campaign.toml").write_text(SIGNED.format(time=time, y=y))
    with pytest.raises(CampaignError, match=message):
        read_campaign(tmp_path)


def record(folder: Path, text: str, units: dict[str, str] | None = None, force: str | None = None) -> TimeRecord:
    path = folder / "record.csv"
    path.write_text(text, encoding="utf-8")
    return make_record_of_columns(read_file(path), name="r", units=units or {"time": "ms", "tip": "mm"}, force=force)


def test_a_record_arrives_in_si(tmp_path: Path) -> None:
    read = record(tmp_path, "time,tip\n0,1\n1,2\n2,4\n")
    assert read.time == pytest.approx([0, 1e-3, 2e-3])
    assert read.channel("tip") == pytest.approx([1e-3, 2e-3, 4e-3])
    assert read.units == ("m",)
    assert read.step == pytest.approx(1e-3)


@pytest.mark.parametrize(("header", "step"), [("time [ms]", 1e-3), ("time", 1.0)])
def test_time_is_in_the_unit_that_the_file_states_else_in_seconds(tmp_path: Path, header: str, step: float) -> None:
    assert record(tmp_path, f"{header},tip\n0,1\n1,2\n2,4\n", {"tip": "mm"}).step == pytest.approx(step)


def test_a_table_with_semicolons_and_columns_that_nothing_uses_is_a_record(tmp_path: Path) -> None:
    read = record(tmp_path, "time;tip;note\n0,5;1,25;9\n1,5;2,5;9\n2,5;4;9\n")
    assert read.channels == ("tip",)
    assert read.time == pytest.approx([5e-4, 1.5e-3, 2.5e-3])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,tip\n0,1\n1,2\n", r'record\.csv: has no column "time"'),
        ("time,tip\n0,1\n0,2\n", r"record\.csv: time does not rise at row 2; sort the rows"),
        ("time,tip\n0,1\n1,nan\n", r'"tip" of record\.csv is not finite.* row 2: a record has no gaps: cut it'),
        ("time,tip\n0,1\nnan,2\n2,2\n", r'"time" of record\.csv is not finite.* row 2: a record has no gaps: cut it'),
        ("time,tip\n0,1\n1,2,5\n", r"record\.csv, line 3: has 3 fields, other rows have 2"),
        ("time\n0\n1\n", r'record\.csv: has no column "tip"'),
    ],
)
def test_a_bad_record_is_named_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        record(tmp_path, text)


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ({"tip": "kg"}, r'record "r": units\.tip: "kg" is not a unit of a time record'),
        ({"tip": "mmm"}, r'units\.tip: unknown unit "mmm"; did you mean "mm"\?'),
        ({"tip": "mm", "time": "Hz"}, r'record "r": time: .*"Hz" is a unit of another quantity'),
    ],
)
def test_a_bad_unit_of_a_record_is_refused(tmp_path: Path, units: dict[str, str], message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        record(tmp_path, "time,tip\n0,1\n1,2\n", units)


def test_a_force_that_is_no_channel_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match='force = "shaker" is not a channel: add shaker = "N" to its units'):
        record(tmp_path, "time,tip\n0,1\n1,2\n", force="shaker")


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    mode = MeasuredMode(name="first", configuration="free", frequency=122.0, frequency_deviation=0.1)
    with pytest.raises(CampaignError, match='mode "first"'):
        write_campaign(replace(made(), data=(mode,)), tmp_path / "data")
    with pytest.raises(CampaignError, match='test "empty" has no rows'):
        write_campaign(replace(made(), tests=(*made().tests, Test(name="empty"))), tmp_path / "rows")
    assert not list(tmp_path.iterdir())


def test_an_uneven_step_is_refused_where_one_is_needed(tmp_path: Path) -> None:
    read = record(tmp_path, "time,tip\n0,1\n1,2\n3,4\n4,5\n")
    with pytest.raises(CampaignError, match=r'record "r" has a step of 0\.002 s after 0\.001 s.*resample it'):
        _ = read.step


@pytest.mark.parametrize(
    ("channel", "unit", "message"),
    [
        ("elsewhere", "m", r'record "ring" has a channel "elsewhere", which is not a sensor; add the sensor, or force'),
        ("y", "m/s", r'channel "y" is in m/s, give V or m'),
    ],
)
def test_a_channel_that_fits_no_sensor_is_refused(tmp_path: Path, channel: str, unit: str, message: str) -> None:
    (tmp_path / "campaign.toml").write_text(
        'schema = 1\n[[sensor]]\nname = "y"\nquantity = "displacement"\ndirection = "z"\nplace = "mass"\n'
        f'[[record]]\nname = "ring"\nfile = "r.csv"\nunits = {{ y = "m", {channel} = "{unit}" }}\n'
        if channel != "y"
        else 'schema = 1\n[[sensor]]\nname = "y"\nquantity = "displacement"\ndirection = "z"\nplace = "mass"\n'
        f'[[record]]\nname = "ring"\nfile = "r.csv"\nunits = {{ y = "{unit}" }}\n'
    )
    columns = ["time", "y"] + ([channel] if channel != "y" else [])
    (tmp_path / "r.csv").write_text("\n".join(",".join(map(str, row)) for row in (columns, range(len(columns)))) + "\n")
    with pytest.raises(CampaignError, match=message):
        read_campaign(tmp_path)
