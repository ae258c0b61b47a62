"""Manifests drafted from files of test programs: what is recognised, what is assumed, and that they can be read."""

import os
import shutil
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile
from numpy.typing import NDArray

from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.read_campaign import check_campaign, read_campaign
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from study.campaign.new_campaign import NewCampaign, draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions, Marked, Question

DATA = os.environ.get("STICKSLIP_DATA", "")
FREQUENCY = np.linspace(90.0, 110.0, 41)
ONES = np.ones(41)


def receptance(frequency: NDArray[np.float64], natural: float = 100.0, ratio: float = 0.01) -> NDArray[np.complex128]:
    """Displacement per force of 1 kg, for e^{+i Omega t} [m/N]."""
    omega, omega_0 = 2 * np.pi * frequency, 2 * np.pi * natural
    return 1.0 / (omega_0**2 - omega**2 + 2j * ratio * omega_0 * omega)


def drafted(folder: Path) -> tuple[NewCampaign, dict[str, Any]]:
    """A draft of a folder with all assumptions; it can be read."""
    campaign = write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()))
    read_campaign(folder)
    return campaign, tomllib.loads(campaign.path.read_text())


def write_csv(path: Path, header: str, *columns: Any) -> None:
    rows = [
        ",".join(one if isinstance(one, str) else repr(float(one)) for one in row) for row in zip(*columns, strict=True)
    ]
    path.write_text("\n".join([header, *rows]) + "\n")


def test_frequency_responses_of_a_uff_have_sensors_places_and_coherences(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    columns = [Column(name="frequency", values=FREQUENCY, unit="Hz")]
    reference = Point(node=1, direction="+z")
    for node, sign, gain in ((1, "+", 1.0), (2, "-", 0.5)):
        point = Point(node=node, direction=f"{sign}z")
        for function, values, unit in (
            ("frequency response", (-1 if sign == "-" else 1) * gain * h, "m/N"), ("coherence", 1 - 0 * FREQUENCY, ""),
        ):  # fmt: skip
            columns.append(
                Column(
                    name=function, values=values, unit=unit, abscissa="frequency", function=function, response=point,
                    reference=reference,
                )
            )  # fmt: skip
    nodes = {1: np.array([0.0, 0.0, 0.1]), 2: np.array([0.5, 0.0, 0.1])}
    write_uff(
        MeasuredFile(path=tmp_path, format="", columns=tuple(columns), nodes=nodes), tmp_path / "frf.uff", binary=True
    )
    _, manifest = drafted(tmp_path)
    (frf,) = manifest["frf"]
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["1Z", "2Z"]
    assert manifest["sensor"][1]["coordinates"] == ["0.5 m", "0 m", "0.1 m"]
    assert frf["columns"]["1Z"] == "58 #4 1Z+/1Z+"
    assert frf["columns"]["2Z"] == {"column": "58 #6 2Z-/1Z+", "sign": -1}
    assert frf["coherence"] == {"1Z": "58 #5 1Z+/1Z+", "2Z": "58 #7 2Z-/1Z+"}
    (datum,) = read_campaign(tmp_path).data
    np.testing.assert_allclose(datum.value, [h, 0.5 * h], rtol=1e-15)


def test_a_frequency_response_with_gaps_is_drafted_without_them(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    gaps = np.where(np.arange(41) % 20 == 3, np.nan, h.real)
    write_csv(tmp_path / "frf.csv", "f [Hz],a re [m/N],a im [m/N],b re [m/N],b im [m/N]", FREQUENCY, h.real, h.imag,
              gaps, h.imag)  # fmt: skip
    campaign, manifest = drafted(tmp_path)
    (frf,) = manifest["frf"]
    assert frf["missing"] == "skip"
    assert any('"b re [m/N]" has no number in 2 of 41 rows' in sentence for sentence in campaign.draft.assumptions())
    assert np.isfinite(read_campaign(tmp_path).data[0].value).sum(axis=1).tolist() == [41, 39]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("degrees", [True, False])
def test_a_stepped_sine_gives_its_response_back(tmp_path: Path, sign: int, degrees: bool) -> None:
    force, h = 2.0 + 0.1 * np.sin(FREQUENCY), receptance(FREQUENCY)
    x = h * force if sign > 0 else (h * force).conj()
    phase = np.degrees(np.angle(x)) if degrees else np.angle(x)
    write_csv(tmp_path / "sine.csv", "freq [Hz],force [N],disp amplitude [m],phase", FREQUENCY, force, np.abs(x), phase)
    campaign, manifest = drafted(tmp_path)
    assert manifest["convention"]["time"] == ("exp(+i omega t)" if sign > 0 else "exp(-i omega t)")
    measurement = read_campaign(tmp_path).measurement
    np.testing.assert_allclose(measurement.value, force * h, rtol=1e-12)
    np.testing.assert_allclose(measurement.force, force, rtol=1e-15)
    assert any("phase_unit" in sentence or "reaches" in sentence for sentence in campaign.draft.assumptions())


@pytest.mark.parametrize("way", ["up", "up and down", "stated"])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_sign_of_time_is_judged_pass_by_pass(tmp_path: Path, sign: int, way: str) -> None:
    """Friction lowers the resonance of a high level: the phases of two levels together turn back and forth."""
    second = FREQUENCY if way == "up" else FREQUENCY[::-1]
    x = np.concatenate([receptance(FREQUENCY), 20 * receptance(second, 98.0, 0.03)])
    x = x if sign > 0 else x.conj()
    header, columns = "f [Hz],x [m],phase [deg]", [np.append(FREQUENCY, second), np.abs(x), np.degrees(np.angle(x))]
    if way == "stated":
        header, columns = f"{header},sweep", [*columns, ["up"] * 41 + ["down"] * 41]
    write_csv(tmp_path / "sine.csv", header, *columns)
    told = draft_campaign(read_folder(tmp_path), Assumptions()).single["convention"]["time"]
    assert told.value == ("exp(+i omega t)" if sign > 0 else "exp(-i omega t)")
    assert "in 2 of 2 curves" in told.assumed


def test_the_sign_of_time_is_judged_also_where_the_frequencies_are_in_no_order(tmp_path: Path) -> None:
    order = np.random.default_rng(2).permutation(41)
    x = receptance(FREQUENCY)[order].conj()
    write_csv(tmp_path / "sine.csv", "f [Hz],x re [m],x im [m]", FREQUENCY[order], x.real, x.imag)
    assert draft_campaign(read_folder(tmp_path), Assumptions()).single["convention"]["time"].value == "exp(-i omega t)"


def test_phases_of_curves_that_contradict_each_other_do_not_tell_the_sign_of_time(tmp_path: Path) -> None:
    first, second = receptance(FREQUENCY), receptance(FREQUENCY).conj()
    for name, x in (("a", first), ("b", first), ("c", second)):
        write_csv(tmp_path / f"{name}.csv", "f [Hz],x re [m],x im [m]", FREQUENCY, x.real, x.imag)
    told = draft_campaign(read_folder(tmp_path), Assumptions()).single["convention"]["time"]
    assert told.value == "exp(+i omega t)"
    assert "falls over the resonance in 2 curves and rises in 1, of 3" in told.assumed


def test_each_sensor_and_the_first_harmonic_of_a_long_table_have_phases_of_their_own(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    series = [("tip", 1, x), ("back", 1, -x), ("back", 3, 0.01 * x.conj())]
    rows = [
        (name, harmonic, f, value.real, value.imag)
        for name, harmonic, values in series
        for f, value in zip(FREQUENCY, values, strict=True)
    ]
    write_csv(tmp_path / "sine.csv", "sensor,harmonic,f [Hz],x re [m],x im [m]", *zip(*rows, strict=True))
    draft = draft_campaign(read_folder(tmp_path), Assumptions())
    told = draft.single["convention"]["time"]
    assert told.value == "exp(+i omega t)"
    assert "in 2 of 2 curves" in told.assumed
    assert [sentence.split(":")[0] for sentence in draft.suspicions if "opposite to" in sentence] == ['sensor "back"']


@pytest.mark.parametrize("names", [("F", "phi_F", "x", "phi_x"), ("force", "phase force", "disp", "phase disp")])
@pytest.mark.parametrize("sign", [1, -1])
def test_phases_of_response_and_force_count_from_a_third_signal(
    tmp_path: Path, names: tuple[str, ...], sign: int
) -> None:
    # The phase of the force turns by four revolutions over the sweep: that of the response alone tells nothing.
    force, h = 2.0 * np.exp(0.4j * np.pi * FREQUENCY), receptance(FREQUENCY)
    x, force = (values if sign > 0 else values.conj() for values in (h * force, force))
    header = f"freq [Hz],{names[0]} [N],{names[1]} [deg],{names[2]} [m],{names[3]} [deg]"
    angles = [np.degrees(np.angle(values)) for values in (force, x)]
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, np.abs(force), angles[0], np.abs(x), angles[1])
    campaign, manifest = drafted(tmp_path)
    assert manifest["convention"]["time"] == ("exp(+i omega t)" if sign > 0 else "exp(-i omega t)")
    assert not campaign.draft.left_out
    np.testing.assert_allclose(read_campaign(tmp_path).measurement.value, 2.0 * h, rtol=1e-12)


@pytest.mark.parametrize("phased", [True, False])
def test_phases_beside_a_force_without_one_are_assumed_to_count_from_it(tmp_path: Path, phased: bool) -> None:
    x = receptance(FREQUENCY)
    header, columns = "freq [Hz],force [N],disp amplitude [m]", [FREQUENCY, ONES, np.abs(x)]
    if phased:
        header, columns = f"{header},phase [deg]", [*columns, np.degrees(np.angle(x))]
    write_csv(tmp_path / "sine.csv", header, *columns)
    campaign, manifest = drafted(tmp_path)
    assert manifest["run"][0]["columns"]["force"] == {"amplitude": "force [N]"}
    assert any("taken to count from it" in each for each in campaign.draft.assumptions()) is phased
    assert ("taken to count from it" in campaign.path.read_text()) is phased


def test_a_phase_of_no_column_is_reported(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    header = "freq [Hz],F [N],x [m],phi_x [deg],phi_ref [deg]"
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, np.abs(x), np.degrees(np.angle(x)), 30 * ONES)
    campaign, _ = drafted(tmp_path)
    assert any('"phi_ref [deg]" is of no column' in sentence for sentence in campaign.draft.left_out)


@pytest.mark.parametrize("kind", ["stepped sine", "steady state"])
@pytest.mark.parametrize(("of_force", "of_response"), [("+", "-"), ("-", "+"), ("-", "-")])
def test_a_channel_against_its_axis_is_turned(tmp_path: Path, kind: str, of_force: str, of_response: str) -> None:
    if kind == "stepped sine":
        abscissa, force = FREQUENCY, 2.0 * ONES + 0j
        x = force * receptance(FREQUENCY)
        value, name, unit = 2.0 * receptance(FREQUENCY), "frequency", "Hz"
    else:
        abscissa = np.arange(8192) / 4096
        force, x = 5 * np.cos(2 * np.pi * 80 * abscissa), 1e-3 * np.cos(2 * np.pi * 80 * abscissa - 0.5)
        value, name, unit = np.array([1e-3 * np.exp(-0.5j)]), "time", "s"
    columns = [Column(name=name, values=abscissa, unit=unit)]
    for node, sign, values, of_values in ((1, of_force, force, "N"), (2, of_response, x, "m")):
        columns.append(
            Column(
                name=f"channel {node}", values=values if sign == "+" else -values, unit=of_values, abscissa=name,
                function="time" if name == "time" else "spectrum", response=Point(node=node, direction=f"{sign}z"),
            )
        )  # fmt: skip
    nodes = {1: np.array([0.0, 0.0, 0.1]), 2: np.array([0.5, 0.0, 0.1])}
    measured = MeasuredFile(path=tmp_path, format="", columns=tuple(columns), nodes=nodes)
    write_uff(measured, tmp_path / "data.uff", binary=True)
    _, manifest = drafted(tmp_path)
    assert [sensor["direction"] for sensor in manifest["sensor"]] == ["z"]
    table = read_campaign(tmp_path).measurement
    # Binary values have all digits; harmonics are fitted to some 1e-6 where the frequency is found.
    np.testing.assert_allclose(table.value[table.harmonic == 1], value, rtol=1e-5)


def write_histories(path: Path, time: NDArray[np.float64], **channels: tuple[NDArray[np.float64], str, str]) -> None:
    """A universal file of channels: values along the axis, unit and the direction in which each reads."""
    columns = [Column(name="time", values=time, unit="s")]
    for node, (name, (values, unit, direction)) in enumerate(channels.items(), start=1):
        columns.append(
            Column(
                name=name, values=-values if direction[0] == "-" else values, unit=unit, abscissa="time",
                function="time", response=Point(node=node, direction=direction),
            )
        )  # fmt: skip
    nodes = {1: np.array([0.0, 0.0, 0.1]), 2: np.array([0.5, 0.0, 0.1])}
    write_uff(MeasuredFile(path=path, format="", columns=tuple(columns), nodes=nodes), path, binary=True)


def test_channels_of_a_record_against_their_axes_are_turned(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal((2, 2048))
    time = np.arange(2048) / 1024
    write_histories(tmp_path / "data.uff", time, F=(noise[0], "N", "-z"), a=(noise[1], "m/s^2", "-z"))
    _, manifest = drafted(tmp_path)
    assert manifest["sensor"][0]["direction"] == "z"
    (record,) = read_campaign(tmp_path).records
    np.testing.assert_allclose(record.values, noise, rtol=1e-12)


@pytest.mark.parametrize("against", ["displacement", "force"])
def test_channels_of_a_loop_against_their_axes_are_turned(tmp_path: Path, against: str) -> None:
    time = np.arange(4000) / 1000
    of_motion, of_force = ("-z" if name == against else "+z" for name in ("displacement", "force"))
    moved, force = 1e-3 * np.cos(2 * np.pi * time), np.cos(2 * np.pi * time + 0.5)
    write_histories(tmp_path / "loop.uff", time, x=(moved, "m", of_motion), F=(force, "N", of_force))
    _, manifest = drafted(tmp_path)
    assert manifest["loop"][0]["columns"][against]["sign"] == -1
    assert not any("wrong sign" in str(item) for item in read_campaign(tmp_path).suspicions)


def test_sweeps_and_levels_of_one_file_are_apart_and_two_branches_are_suspected(tmp_path: Path) -> None:
    up, down = 1.0 + 0 * FREQUENCY, np.where((FREQUENCY > 99) & (FREQUENCY < 104), 3.0, 1.0)
    rows = [(level, word, f, a * level) for level in (1.0, 2.0) for word, size in (("up", up), ("down", down))
            for f, a in sorted(zip(FREQUENCY, size, strict=True), reverse=word == "down")]  # fmt: skip
    write_csv(tmp_path / "sweeps.csv", "level,sweep,frequency_Hz,amplitude", *zip(*rows, strict=True))
    campaign, manifest = drafted(tmp_path)
    assert [run["level"] for run in manifest["run"]] == [1.0, 2.0]
    assert manifest["drive"]["calibrated"] is False
    (sensor,) = manifest["sensor"]
    assert (sensor["phase"], sensor["calibrated"]) == (False, False)
    measurement = read_campaign(tmp_path).measurement
    assert sorted(set(measurement.sweep.tolist())) == [-1, 1]
    assert len(measurement.value) == len(rows)
    assert any("factor of 3" in sentence and "two branches" in sentence for sentence in campaign.suspicions)


def test_files_with_equal_columns_are_repeats_of_one_level(tmp_path: Path) -> None:
    for number, level in enumerate((5.0, 5.04, 10.0), start=1):
        x = level * receptance(FREQUENCY)
        write_csv(
            tmp_path / f"run_{number}.csv", "f [Hz],F [N],re [m],im [m]", FREQUENCY, level * ONES, x.real, x.imag
        )  # fmt: skip
    _, manifest = drafted(tmp_path)
    assert [test["name"] for test in manifest["test"]] == ["run"]
    assert [run.get("repeat", 1) for run in manifest["run"]] == [1, 2, 1]
    assert [run.get("level") for run in manifest["run"]] == [5.0, 5.0, None]
    measurement = read_campaign(tmp_path).measurement
    assert sorted(set(measurement.level.tolist())) == [5.0, 10.0]


@pytest.mark.parametrize("with_phase", [True, False])
@pytest.mark.parametrize("unit", ["s", "min"])
def test_a_time_stamp_beside_a_frequency_makes_no_record(tmp_path: Path, with_phase: bool, unit: str) -> None:
    x = receptance(FREQUENCY)
    header, columns = f"time [{unit}],f [Hz],F [N],x [m]", [12.5 * np.arange(41.0), FREQUENCY, ONES, np.abs(x)]
    if with_phase:
        header, columns = f"{header},phase [deg]", [*columns, np.degrees(np.angle(x))]
    write_csv(tmp_path / "sine.csv", header, *columns)
    _, manifest = drafted(tmp_path)
    assert "record" not in manifest
    value = read_campaign(tmp_path).measurement.value
    np.testing.assert_allclose(value if with_phase else np.abs(value), x if with_phase else np.abs(x), rtol=1e-12)


def test_a_history_with_the_frequency_of_its_generator_stays_a_record(tmp_path: Path) -> None:
    time = np.arange(4096) / 2000
    frequency = 90 + 10 * time
    noise = np.random.default_rng(5).standard_normal((2, 4096))
    write_csv(tmp_path / "sweep.csv", "time [s],f [Hz],F [N],acc [m/s^2]", time, frequency, noise[0], noise[1])
    _, manifest = drafted(tmp_path)
    assert len(manifest["record"]) == 1


def test_a_voltage_that_drives_is_the_level_of_sweeps_up_and_down(tmp_path: Path) -> None:
    volts, f = np.repeat([0.05, 0.2, 0.5], 41), np.tile(FREQUENCY, 3)
    for name, way in (("up", 1), ("down", -1)):
        order = np.concatenate([np.arange(41)[::way] + 41 * number for number in range(3)])
        size = 1e6 * volts[order] * np.abs(receptance(f[order]))
        write_csv(tmp_path / f"sweep_{name}.csv", "Frequenz [Hz],Spannung [V],Weg [um]", f[order], volts[order], size)
    _, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["weg"]
    assert manifest["drive"]["calibrated"] is False
    table = read_campaign(tmp_path).measurement
    assert set(table.level.tolist()) == {0.05, 0.2, 0.5}
    assert set(zip(table.sweep.tolist(), table.repeat.tolist(), strict=True)) == {(1, 1), (-1, 1)}


def test_of_channels_that_are_all_voltages_one_is_a_response(tmp_path: Path) -> None:
    size = np.abs(receptance(FREQUENCY))
    write_csv(tmp_path / "d.csv", "f [Hz],Voltage_0 [V],Voltage_1 [V]", FREQUENCY, size, 0.5 * size)
    _, manifest = drafted(tmp_path)
    assert [sensor["calibrated"] for sensor in manifest["sensor"]] == [False, False]


def test_readings_that_settle_are_no_repeats(tmp_path: Path) -> None:
    frequency = np.repeat(FREQUENCY, 4)
    size = np.abs(receptance(frequency)) * (1 + 0.2 * 0.4 ** np.tile(np.arange(4.0), len(FREQUENCY)))
    write_csv(
        tmp_path / "slow.csv", "frequency [Hz],force [N],acc amplitude [m/s^2]", frequency, 1 + 0 * frequency, size
    )
    _, manifest = drafted(tmp_path)
    assert manifest["test"][0]["settling"] is True
    noise = np.random.default_rng(1).normal(size=len(frequency))
    scattered = np.abs(receptance(frequency)) * (1 + 0.01 * noise)
    write_csv(
        tmp_path / "slow.csv", "frequency [Hz],force [N],acc amplitude [m/s^2]", frequency, 1 + 0 * frequency, scattered
    )
    draft = draft_campaign(read_folder(tmp_path, overwrite=True), Assumptions())
    assert "settling" not in draft.entries["test"][0]


@pytest.mark.parametrize("answer", ["repeats", "settling"])
def test_a_person_is_asked_once_whether_runs_and_readings_are_repeats(tmp_path: Path, answer: str) -> None:
    asked = []

    class Person:
        def ask(self, question: Question) -> Marked:
            asked.append(question.text)
            is_it = set(question.choices) == {"repeats", "settling"}
            return Marked(value=answer if is_it else question.default)

    x = np.abs(receptance(FREQUENCY))
    for number in range(2):
        write_csv(tmp_path / f"run_{number}.csv", "f [Hz],F [N],a [m]", FREQUENCY, ONES, x)
    write_csv(tmp_path / "slow.csv", "f [Hz],F [N],b [m]", np.repeat(FREQUENCY, 3), np.repeat(ONES, 3), np.repeat(x, 3))
    draft = draft_campaign(read_folder(tmp_path), Person())
    assert len({text for text in asked if "settles" in text}) == 2
    assert [test.get("settling") is not None for test in draft.entries["test"]] == [answer == "settling"] * 2
    assert not [sentence for sentence in draft.assumptions() if "repeat = " in sentence]


@pytest.mark.parametrize(
    ("name", "repeats"),
    [("sine_{level}N_{repeat}", [1, 2, 3, 2, 3, 3]), ("rep{repeat}_{level}N", [1, 2, 3, 2, 3, 3]),
     ("sine_{run}", [1, 2, 3, 1, 2, None]), ("sine_{level}N_{repeat}_2024", [1, 2, 3, 1, 2, None])],
)  # fmt: skip
def test_repeats_are_numbered_as_their_files_where_these_number_repeats(
    tmp_path: Path, name: str, repeats: list[int | None]
) -> None:
    x = np.abs(receptance(FREQUENCY))
    there = [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (4, 3)]  # others are lost
    files = {}
    for (level, repeat), number in zip(there, repeats, strict=True):
        file = f"{name.format(level=level, repeat=repeat, run=10 * level + repeat)}.csv"
        files[file] = number
        write_csv(tmp_path / file, "f [Hz],F [N],a [m]", FREQUENCY, level * ONES, level * x)
    _, manifest = drafted(tmp_path)
    assert {run["file"]: run.get("repeat") for run in manifest["run"]} == files


@pytest.mark.parametrize(
    ("files", "order", "said"),
    [(2, False, "that of the names of their files"), (1, False, ""), (2, True, "")],
    ids=["two", "one", "stated"],
)
def test_the_order_of_runs_is_assumed_in_print_and_in_the_file(
    tmp_path: Path, files: int, order: bool, said: str
) -> None:
    x = np.abs(receptance(FREQUENCY))
    for number in range(files):
        columns = [FREQUENCY, (1 + number) * ONES, (1 + number) * x, *([number * 50 + np.arange(41)] if order else [])]
        write_csv(tmp_path / f"{number}.csv", "f [Hz],F [N],a [m]" + ",order" * order, *columns)
    campaign, _ = drafted(tmp_path)
    told = [sentence for sentence in campaign.draft.assumptions() if sentence.startswith("order of the 2 runs")]
    assert len(told) == bool(said)
    assert all(said in sentence for sentence in told)
    assert [line for line in campaign.path.read_text().splitlines() if line == f"# assumed: {''.join(told)}"] == [
        f"# assumed: {sentence}" for sentence in told
    ]


def test_nothing_contradicts_that_readings_settle(tmp_path: Path) -> None:
    frequency = np.repeat(FREQUENCY, 6)
    x = receptance(frequency) * (1 - 0.4 * np.exp(-0.9 * np.tile(np.arange(6.0), 41)))
    columns = [frequency, 2 + 0 * frequency, np.abs(x), np.degrees(np.angle(x))]
    write_csv(tmp_path / "sine.csv", "f [Hz],F [N],a [m],phase [deg]", *columns)
    campaign, manifest = drafted(tmp_path)
    assert manifest["test"][0]["settling"] is True
    assert not campaign.suspicions


def test_groups_named_by_level_and_repeat_are_one_test(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "blade.h5", "w") as file:
        for level in (0.5, 2.0):
            for repeat in (1, 2):
                group = file.create_group(f"level_{level:g}N_rep{repeat}".replace(".", "p"))
                columns = {"frequency": FREQUENCY, "force": level * ONES, "disp": level * receptance(FREQUENCY)}
                for (name, values), unit in zip(columns.items(), ("Hz", "N", "m"), strict=True):
                    group.create_dataset(name, data=values).attrs["unit"] = unit
    _, manifest = drafted(tmp_path)
    assert [test["name"] for test in manifest["test"]] == ["blade"]
    table = read_campaign(tmp_path).measurement
    pairs = set(zip(table.level.tolist(), table.repeat.tolist(), strict=True))
    assert pairs == {(0.5, 1), (0.5, 2), (2.0, 1), (2.0, 2)}


def test_a_pair_of_load_cells_gives_the_forces_of_a_line(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    names = "f [Hz],F [N],R3_re [N],R3_im [N],R4_re [N],R4_im [N],R5_re [N],R5_im [N]"
    write_csv(tmp_path / "sine.csv", names, FREQUENCY, 5 * ONES, h.real, h.imag, 2 * h.real, 2 * h.imag, h.real, h.imag)
    campaign, manifest = drafted(tmp_path)
    (pair,) = manifest["load_cells"]
    assert pair["cells"] == ["R3", "R4"]
    assumed = campaign.draft.assumptions()
    assert all(any(f"{key} = " in sentence for sentence in assumed) for key in ("taper", "arm", "side", "line"))
    assert any('"R5"' in sentence for sentence in campaign.draft.left_out)
    read = read_campaign(tmp_path)
    assert {sensor.component for sensor in read.sensors} == {"tangential", "normal"}


def test_steady_states_without_names_have_their_first_channel_as_drive(tmp_path: Path) -> None:
    time = np.arange(8192) / 4096
    for number, f in enumerate((80.0, 85.0)):
        channels = np.stack([0.02 * np.cos(2 * np.pi * f * time), 0.01 * np.cos(2 * np.pi * f * time - 0.5)], axis=1)
        scipy.io.wavfile.write(tmp_path / f"steady_{number}.wav", 4096, channels.astype(np.float32))
    campaign, manifest = drafted(tmp_path)
    assert "record" not in manifest
    assert manifest["drive"]["calibrated"] is False
    assert any("channel 1" in sentence and "usually the first" in sentence for sentence in campaign.draft.assumptions())
    table = read_campaign(tmp_path).measurement
    # Six digits in the file; harmonics are fitted to some 1e-6 where the frequency is found.
    np.testing.assert_allclose(table.frequency[table.harmonic == 1], [80.0, 85.0], rtol=1e-5)
    np.testing.assert_allclose(table.value[table.harmonic == 1], 0.01 * np.exp(-0.5j), rtol=1e-4)


def test_an_acceleration_with_the_phase_of_a_displacement_is_suspected(tmp_path: Path) -> None:
    x = receptance(FREQUENCY) * (2 * np.pi * FREQUENCY) ** 2  # an acceleration is -omega^2 x
    header = "frequency [Hz],force [N],amplitude [m/s^2],phase [rad]"
    write_csv(tmp_path / "a.csv", header, FREQUENCY, ONES, np.abs(x), np.angle(x))
    campaign, manifest = drafted(tmp_path)
    # The sensor may be beyond a node: its readings stay as they are.
    assert "sign" not in manifest["run"][0]["columns"]["acceleration"]
    assert any("opposite to acceleration" in sentence for sentence in campaign.suspicions)


@pytest.mark.parametrize("node", [1, 2])
def test_a_sensor_at_the_force_with_the_opposite_phase_gets_its_sign(tmp_path: Path, node: int) -> None:
    h = receptance(FREQUENCY) * (2 * np.pi * FREQUENCY) ** 2
    one = Column(
        name="h", values=h, unit="(m/s^2)/N", abscissa="frequency", function="frequency response",
        response=Point(node=node, direction="+z"), reference=Point(node=1, direction="+z"),
    )  # fmt: skip
    columns = (Column(name="frequency", values=FREQUENCY, unit="Hz"), one)
    write_uff(MeasuredFile(path=tmp_path, format="", columns=columns), tmp_path / "h.uff", binary=True)
    _, manifest = drafted(tmp_path)
    (value,) = (one for name, one in manifest["frf"][0]["columns"].items() if name != "frequency")
    assert (isinstance(value, dict) and value.get("sign") == -1) == (node == 1)


def test_a_universal_file_without_units_is_a_displacement_that_is_not_calibrated(tmp_path: Path) -> None:
    one = Column(
        name="h", values=receptance(FREQUENCY), abscissa="frequency", function="frequency response",
        response=Point(node=2, direction="+z"), reference=Point(node=1, direction="+z"),
    )  # fmt: skip
    columns = (Column(name="frequency", values=FREQUENCY, unit="Hz"), one)
    write_uff(MeasuredFile(path=tmp_path, format="", columns=columns), tmp_path / "h.uff", binary=True)
    campaign, manifest = drafted(tmp_path)
    (sensor,) = manifest["sensor"]
    assert (sensor["quantity"], sensor["calibrated"]) == ("displacement", False)
    said = campaign.draft.assumptions()
    assert any("quantity = displacement" in sentence for sentence in said)
    assert any("calibrated = false" in sentence for sentence in said)


def test_the_level_of_ratios_to_newtons_is_in_newtons(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    write_csv(tmp_path / "h.csv", "f [Hz],re [m/N],im [m/N]", FREQUENCY, h.real, h.imag)
    campaign, manifest = drafted(tmp_path)
    assert manifest["units"]["level"] == "N"
    assert not any("unit of the force" in sentence for sentence in campaign.draft.assumptions())


STACK = [(gain, way) for gain in (1.0, 3.0, 10.0) for way in (1, -1)]


@pytest.mark.parametrize("words", [("up", "down"), ("Auf", "Ab"), None])
def test_stacked_levels_without_a_level_are_no_repeats(tmp_path: Path, words: tuple[str, str] | None) -> None:
    f = np.concatenate([FREQUENCY[::way] for _, way in STACK])
    size = np.concatenate([gain * np.abs(receptance(FREQUENCY[::way])) for gain, way in STACK])
    columns, header = [f, size], "f [Hz],acc tip amplitude [g]"
    if words is not None:
        columns.append([words[0 if way > 0 else 1] for _, way in STACK for _ in FREQUENCY])
        header += ",Richtung"
    write_csv(tmp_path / "stack.csv", header, *columns)
    campaign, manifest = drafted(tmp_path)
    assert [run["level"] for run in manifest["run"]] == [1.0]
    assert any("differ by factors 1 : 1 : 3 : 3 : 10 : 10: levels" in one for one in campaign.draft.assumptions())
    assert any("differ by factors 1 : 3 : 10 over the whole sweep" in one for one in campaign.suspicions)

    class Person:
        def ask(self, question: Question) -> Marked:
            levels = "2, 2, 6, 6, 20, 20"
            return Marked(value=levels if "6 sweeps" in question.text else question.default)

    campaign = write_manifest(measured := read_folder(tmp_path, overwrite=True), draft_campaign(measured, Person()))
    assert tomllib.loads(campaign.path.read_text())["run"][0]["levels"] == [2.0, 2.0, 6.0, 6.0, 20.0, 20.0]
    measurement = read_campaign(tmp_path).measurement
    assert set(measurement.level.tolist()) == {2.0, 6.0, 20.0}
    assert set(measurement.repeat.tolist()) == {1}


def test_a_draft_that_cannot_be_read_is_left_to_be_edited(tmp_path: Path) -> None:
    f, size = np.tile(FREQUENCY, 2), np.abs(np.concatenate([receptance(FREQUENCY), 3 * receptance(FREQUENCY)]))
    write_csv(tmp_path / "stack.csv", "f [Hz],acc tip amplitude [g],repeat", f, size, 1 + 0 * f)
    measured = read_folder(tmp_path)
    draft = draft_campaign(measured, Assumptions())
    with pytest.raises(CampaignError, match=r"or its level if these are levels.*the draft with all entries is in"):
        write_manifest(measured, draft)
    assert len(tomllib.loads((tmp_path / "campaign.toml").read_text())["run"]) == 1


def test_stacked_levels_have_the_measured_force_of_each_sweep(tmp_path: Path) -> None:
    f = np.concatenate([FREQUENCY[::way] for _, way in STACK])
    size = np.concatenate([gain * np.abs(receptance(FREQUENCY[::way])) for gain, way in STACK])
    force = np.repeat([gain for gain, _ in STACK], len(FREQUENCY)) * (1 + 0.001 * np.sin(np.arange(len(f))))
    write_csv(tmp_path / "stack.csv", "f [Hz],force [N],acc tip amplitude [g]", f, force, size)
    _, manifest = drafted(tmp_path)
    assert manifest["run"][0]["levels"] == [1.0, 1.0, 3.0, 3.0, 10.0, 10.0]


@pytest.mark.parametrize(
    "names",
    [("acc_tip_g", "phase_tip_deg", "acc_root_g", "phase_root_deg"),
     ("a_Spitze [g]", "phi_Spitze [deg]", "a_Fuß [g]", "phi_Fuß [deg]")],
)  # fmt: skip
def test_phases_belong_to_the_responses_of_their_place(tmp_path: Path, names: tuple[str, ...]) -> None:
    h = receptance(FREQUENCY)
    turned = np.degrees(np.angle(h))
    write_csv(
        tmp_path / "sine.csv", ",".join(["f [Hz],F [N]", *names]), FREQUENCY, ONES, np.abs(h), turned, np.abs(h),
        turned - 180,
    )  # fmt: skip
    campaign, manifest = drafted(tmp_path)
    assert not campaign.draft.left_out
    paired = {one["amplitude"]: one["phase"] for one in manifest["run"][0]["columns"].values() if "phase" in one}
    assert paired == {names[0]: names[1], names[2]: names[3]}


def test_one_phase_for_two_quantities_of_a_place_is_of_none(tmp_path: Path) -> None:
    h = np.abs(receptance(FREQUENCY))
    header = "f [Hz],F [N],acc_tip_g,vel_tip_mm_s,phase_tip_deg"
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, h, 2 * h, 30 * ONES)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["phase"] for sensor in manifest["sensor"]] == [False, False]
    assert any("phase = false" in sentence for sentence in campaign.draft.assumptions())
    assert any('phase_unit = "deg"' in one and "remove phase = false" in one for one in campaign.draft.left_out)


def test_sensors_at_one_assumed_place_are_suspected_and_named_by_their_quantity(tmp_path: Path) -> None:
    h = np.abs(receptance(FREQUENCY))
    header = "f [Hz],F [N],Tip amplitude [m/s^2],Root amplitude [m/s^2],acc mid [m/s^2]"
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, h, 2 * h, 3 * h)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["tip acceleration", "root acceleration", "acc mid"]
    assert any('all read the acceleration at "tip" along z' in sentence for sentence in campaign.suspicions)


def test_a_place_may_be_answered_by_coordinates(tmp_path: Path) -> None:
    class Person:
        def ask(self, question: Question) -> Marked:
            return Marked(value="0.5 m, 0 m, 10 mm y" if question.text.startswith("Where") else question.default)

    header = "f [Hz],F [N],acc tip [m/s^2]"
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, np.abs(receptance(FREQUENCY)))
    write_manifest(measured := read_folder(tmp_path), draft_campaign(measured, Person()))
    (sensor,) = read_campaign(tmp_path).sensors
    assert sensor.coordinates is not None
    assert (sensor.coordinates.tolist(), sensor.direction) == ([0.5, 0.0, 0.01], "y")


def test_values_that_one_sensor_lacks_are_left_out_of_it_alone(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    broken = np.where(np.arange(41) % 10 == 3, np.nan, np.abs(h))
    write_csv(tmp_path / "sine.csv", "f [Hz],F [N],acc tip [g],acc root [g]", FREQUENCY, ONES, broken, np.abs(h))
    campaign, _ = drafted(tmp_path)
    assert any('"acc tip [g]" has no number in 4 of 41 rows' in sentence for sentence in campaign.draft.assumptions())
    assert any("4 of 41 rows have no number" in sentence for sentence in campaign.suspicions)
    read = read_campaign(tmp_path)
    count = np.bincount(read.measurement.sensor)
    assert dict(zip([one.name for one in read.sensors], count.tolist(), strict=True)) == {"acc tip": 37, "acc root": 41}


@pytest.mark.parametrize(("name", "kind"), [("hammer_frf.csv", "frf"), ("sweep.csv", "run")])
def test_the_name_of_a_file_tells_frequency_responses(tmp_path: Path, name: str, kind: str) -> None:
    h = receptance(FREQUENCY)
    write_csv(tmp_path / name, "Hz,real,imag", FREQUENCY, h.real, h.imag)
    _, manifest = drafted(tmp_path)
    assert len(manifest[kind]) == 1


def test_a_ring_down_after_a_hammer_is_recognised(tmp_path: Path) -> None:
    time = np.arange(4000) / 2000
    acc = np.where(time < 0.02, 0.0, np.exp(-3 * (time - 0.02)) * np.sin(2 * np.pi * 50 * time))
    hammer = np.where(np.abs(time - 0.02) < 0.002, 100.0, 0.0)
    write_csv(tmp_path / "hit.csv", "time [s],hammer [N],acc tip [g]", time, hammer, acc)
    _, manifest = drafted(tmp_path)
    assert manifest["ring_down"][0]["columns"] == {"time": "time [s]", "value": "acc tip [g]"}
    (decay,) = read_campaign(tmp_path).data
    # 50 Hz and 3 / (2 pi 50) were written.
    assert np.median(decay.modes[0].frequency) == pytest.approx(50.0, rel=1e-3)


def test_loops_of_several_amplitudes_are_loops_each(tmp_path: Path) -> None:
    rows = []
    for amplitude in (1.0, 2.0):
        time = np.arange(1024) / 128
        x = amplitude * np.sin(2 * np.pi * time)
        force = 10 * x + 3.0 * np.sign(np.cos(2 * np.pi * time))
        rows += [(amplitude, *row) for row in zip(time, x, force, strict=True)]
    write_csv(tmp_path / "damper.csv", "amplitude_mm,time_s,displacement_mm,force_N", *zip(*rows, strict=True))
    _, manifest = drafted(tmp_path)
    assert [loop["rows"] for loop in manifest["loop"]] == [{"amplitude_mm": 1.0}, {"amplitude_mm": 2.0}]
    assert [loop["name"].split(" ", 1)[1] for loop in manifest["loop"]] == ["1 mm", "2 mm"]
    assert all(float(loop["frequency"].split()[0]) == pytest.approx(1.0, rel=0.01) for loop in manifest["loop"])


def test_a_steady_state_over_time_is_a_run(tmp_path: Path) -> None:
    time = np.arange(8192) / 4096
    force, x = 5 * np.cos(2 * np.pi * 80 * time), 1e-3 * np.cos(2 * np.pi * 80 * time - 0.5)
    with h5py.File(tmp_path / "steady.h5", "w") as file:
        channels = (("time", time, "s"), ("force", force, "N"), ("acc", x, "m/s^2"), ("acc2", 2 * x, "m/s^2"))
        for name, values, unit in channels:
            file.create_dataset(name, data=values).attrs["unit"] = unit
    _, manifest = drafted(tmp_path)
    assert manifest["run"][0]["columns"]["time"] == "time"
    campaign = read_campaign(tmp_path)
    first = campaign.measurement.where((campaign.measurement.harmonic == 1) & (campaign.measurement.sensor == 0))
    # cos(Omega t - 0.5) against cos(Omega t): amplitude 1e-3, phase -0.5 rad.
    np.testing.assert_allclose(first.value, 1e-3 * np.exp(-0.5j), rtol=1e-6)


def test_volts_without_time_are_a_record_with_an_assumed_rate(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    write_csv(tmp_path / "volts.csv", "V1,V2", rng.normal(size=500), rng.normal(size=500))
    campaign, manifest = drafted(tmp_path)
    (record,) = manifest["record"]
    assert (record["force"], record["units"]) == ("V1", {"V1": "V", "V2": "V"})
    assert any("rate" in sentence and "no time" in sentence for sentence in campaign.draft.assumptions())


def test_records_alone_are_told_to_be_compared_by_no_command(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=2000)
    write_csv(tmp_path / "noise.csv", "time [s],acc [g]", np.arange(2000) / 1000, noise)
    campaign, _ = drafted(tmp_path)
    assert any("which no command compares" in sentence for sentence in campaign.suspicions)


def test_what_cannot_be_read_or_used_is_left_out_with_its_reason(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    write_csv(tmp_path / "good.csv", "f [Hz],re [m/N],im [m/N]", FREQUENCY, x.real, x.imag)
    (tmp_path / "cut.uff").write_bytes(b"    -1\n    58\nNONE\n")
    (tmp_path / "README.md").write_text("about")
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["frf"]) == 1
    assert any("cut.uff" in sentence for sentence in campaign.draft.left_out)
    assert "left out: cut.uff" in campaign.path.read_text()


def test_an_entry_that_the_campaign_refuses_is_left_out(tmp_path: Path) -> None:
    header, size = "f [Hz],force [N],acc amplitude [m/s^2]", np.abs(receptance(FREQUENCY))
    write_csv(tmp_path / "good.csv", header, FREQUENCY, ONES, size)
    write_csv(tmp_path / "bad.csv", header, FREQUENCY, 2 * ONES, np.where(FREQUENCY == 90.0, -1.0, size))
    campaign, manifest = drafted(tmp_path)
    assert [run["file"] for run in manifest["run"]] == ["good.csv"]
    assert any("bad.csv" in sentence and "negative" in sentence for sentence in campaign.draft.left_out)


@pytest.mark.parametrize("exists", [True, False])
def test_a_manifest_is_not_overwritten(tmp_path: Path, exists: bool) -> None:
    x = receptance(FREQUENCY)
    write_csv(tmp_path / "good.csv", "f [Hz],re [m/N],im [m/N]", FREQUENCY, x.real, x.imag)
    if exists:
        (tmp_path / "campaign.toml").write_text("mine")
        with pytest.raises(CampaignError, match="is there already"):
            read_folder(tmp_path)
        assert (tmp_path / "campaign.toml").read_text() == "mine"
    write_manifest(measured := read_folder(tmp_path, overwrite=exists), draft_campaign(measured, Assumptions()))
    assert "schema = 1" in (tmp_path / "campaign.toml").read_text()


def test_a_folder_without_measurements_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "names.csv").write_text("a,b\nx,y\n")
    with pytest.raises(CampaignError, match=r"nothing in .* can be compared .*names\.csv") as error:
        draft_campaign(read_folder(tmp_path), Assumptions())
    assert "\n" not in str(error.value)
    with pytest.raises(CampaignError, match="there is no folder"):
        read_folder(tmp_path / "nowhere")


def test_answers_stand_in_the_manifest_without_a_mark(tmp_path: Path) -> None:
    class Person:
        def __init__(self) -> None:
            self.asked: list[str] = []

        def ask(self, question: Question) -> Marked:
            self.asked.append(question.text)
            assert question.why
            return Marked(value="middle y" if "Where is" in question.text else question.default)

    x = receptance(FREQUENCY)
    write_csv(tmp_path / "good.csv", "f [Hz],acc re [m/s^2/N],acc im [m/s^2/N]", FREQUENCY, x.real, x.imag)
    person = Person()
    campaign = write_manifest(measured := read_folder(tmp_path), draft_campaign(measured, person))
    (sensor,) = tomllib.loads(campaign.path.read_text())["sensor"]
    assert (sensor["place"], sensor["direction"]) == ("middle", "y")
    assert len({*person.asked}) <= 3


@pytest.mark.skipif(not Path(DATA, "brb_forced").is_dir(), reason="measured sets are not here")
@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("brb_forced", {"run": 12, "ring_down": 3}),
        ("silverbox", {"record": 1}),
        ("measured/mag_oscillator", {"run": 4}),
        ("measured/friction_damper", {"loop": 7}),
        ("measured/resonant_beams", {"ring_down": 6}),
    ],
)
def test_measured_sets_are_recognised(tmp_path: Path, name: str, kinds: dict[str, int]) -> None:
    folder = shutil.copytree(Path(DATA, name), tmp_path / "set")
    folder.chmod(0o755)
    campaign = write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()))
    manifest = tomllib.loads(campaign.path.read_text())
    entries = {kind: len(manifest[kind]) for kind in ("run", "frf", "ring_down", "loop", "record") if kind in manifest}
    assert entries == kinds


def test_a_recording_without_a_unit_is_no_displacement_of_kilometres(tmp_path: Path) -> None:
    time = np.arange(4000) / 2000
    wave = 3e4 * np.exp(-2 * time) * np.cos(2 * np.pi * 32 * time)
    scipy.io.wavfile.write(tmp_path / "release.wav", 2000, wave.astype(np.int16))
    assert any("numbers of a recorder" in sentence for sentence in drafted(tmp_path)[0].suspicions)


def test_sweeps_up_and_down_in_groups_are_runs_of_one_test(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "sweep.h5", "w") as file:
        for way, step in (("up", 1), ("down", -1)):
            for force in (1.0, 3.0):
                group = file.create_group(f"{way}/{force:g}N")
                columns = {"frequency": FREQUENCY, "force": force * ONES, "acc_a": np.abs(receptance(FREQUENCY))}
                for name, unit in (("frequency", "Hz"), ("force", "N"), ("acc_a", "m/s^2")):
                    group.create_dataset(name, data=columns[name][::step]).attrs["unit"] = unit
    _, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 4
    assert [test["name"] for test in manifest["test"]] == ["sweep"]
    assert {*read_campaign(tmp_path).measurement.sweep.tolist()} == {1, -1}


def test_amplitudes_in_decibels_are_drafted_with_their_unit(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    write_csv(tmp_path / "frf.csv", "f [Hz],|H| [dB re 1 (m/s^2)/N],phase [deg]", FREQUENCY, 20 * np.log10(abs(h)),
              np.degrees(np.angle(h)))  # fmt: skip
    measured = read_folder(tmp_path)
    write_manifest(measured, draft_campaign(measured, Assumptions()))
    text = (tmp_path / "campaign.toml").read_text()
    manifest = tomllib.loads(text)
    assert manifest["sensor"][0]["quantity"] == "acceleration"
    assert "is taken for 20 lg of an amplitude" in text
    (response,) = read_campaign(tmp_path).data
    np.testing.assert_allclose(np.abs(response.value[0]), abs(h), rtol=1e-5)


def test_a_draft_reads_each_file_once_and_fits_no_decay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    time = np.arange(2000) / 2000
    decay, noise = np.exp(-6 * time) * np.cos(2 * np.pi * 60 * time), np.random.default_rng(1).standard_normal(2000)
    write_csv(tmp_path / "released.csv", "time [s],acc tip [m/s^2]", time, decay)
    measured = read_folder(tmp_path)
    for name in ("correlation.data_type.ring_down.analyse_ring_down", "correlation.campaign.measured_files.read_file"):
        monkeypatch.setattr(name, None)
    write_manifest(measured, draft_campaign(measured, Assumptions()))
    assert len(tomllib.loads((tmp_path / "campaign.toml").read_text())["ring_down"]) == 1
    # What the fit refuses is refused as well.
    write_csv(tmp_path / "released.csv", "time [s],acc tip [m/s^2]", time, noise)
    with pytest.raises(CampaignError, match="nothing oscillates"):
        check_campaign(MeasuredFiles(folder=tmp_path, known=dict(read_folder(tmp_path, overwrite=True).files)))


def test_an_array_of_responses_has_a_sensor_per_output_and_one_input(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    table = h[:, None, None] * np.array([[1.0, 0.5], [0.7, -0.2]])
    scipy.io.savemat(tmp_path / "frf.mat", {"f": FREQUENCY, "H": table})
    campaign, manifest = drafted(tmp_path)
    (frf,) = manifest["frf"]
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["h 1", "h 2"]
    assert set(frf["columns"]) == {"frequency", "h 1", "h 2"}
    assert any("input 2" in sentence for sentence in campaign.draft.left_out)


def test_words_of_a_table_are_its_sensors_and_values_of_the_force_its_levels(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    rows = [(word, level, f, abs(gain * level * x), np.angle(x)) for level in (1.0, 5.0)
            for word, gain in (("tip", 1.0), ("mid", 0.5)) for f, x in zip(FREQUENCY, h, strict=True)]  # fmt: skip
    write_csv(tmp_path / "long.csv", "sensor,force_N,frequency_Hz,amplitude_m,phase_rad", *zip(*rows, strict=True))
    _, manifest = drafted(tmp_path)
    assert {sensor["name"] for sensor in manifest["sensor"]} == {"tip", "mid"}
    campaign = read_campaign(tmp_path)
    assert campaign.levels.tolist() == [1.0, 5.0]
    mid = campaign.measurement.where(campaign.measurement.sensor == [s.name for s in campaign.sensors].index("mid"))
    np.testing.assert_allclose(mid.value, np.concatenate([0.5 * h, 2.5 * h]), rtol=1e-12)


def test_groups_with_numbers_are_repeats_and_levels_stand_in_names(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "runs.h5", "w") as file:
        for number in (1, 2):
            group = file.create_group(f"run_{number}")
            for name, values, unit in (
                ("f", FREQUENCY, "Hz"),
                ("F", 4 * ONES, "N"),
                ("x", 4 * receptance(FREQUENCY), "m"),
            ):
                group.create_dataset(name, data=values).attrs["unit"] = unit
    _, manifest = drafted(tmp_path)
    assert [run["repeat"] for run in manifest["run"]] == [1, 2]
    (tmp_path / "runs.h5").unlink()
    (tmp_path / "campaign.toml").unlink()
    for level in ("0.5", "2"):
        write_csv(
            tmp_path / f"sweep_{level}V.csv", "freq,reading", FREQUENCY, float(level) * np.abs(receptance(FREQUENCY))
        )
    _, manifest = drafted(tmp_path)
    assert [run["level"] for run in manifest["run"]] == [0.5, 2.0]
    assert manifest["drive"]["calibrated"] is False
    assert len(manifest["test"]) == 1


def test_a_shaken_base_is_the_drive(tmp_path: Path) -> None:
    omega = 2 * np.pi * FREQUENCY
    ratio = 1 + omega**2 * receptance(FREQUENCY)
    header = "frequency [Hz],base acceleration [m/s^2],tip amplitude [m/s^2],tip phase [deg]"
    write_csv(tmp_path / "base.csv", header, FREQUENCY, 2 * ONES, 2 * np.abs(ratio), np.degrees(np.angle(ratio)))
    _, manifest = drafted(tmp_path)
    assert manifest["drive"]["quantity"] == "base acceleration"
    campaign = read_campaign(tmp_path)
    np.testing.assert_allclose(campaign.measurement.value, 2 * ratio, rtol=1e-12)


def test_a_dead_channel_is_left_out_and_the_others_stay(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    header = "f [Hz],F [N],a re [m],a im [m],dead amplitude [m]"
    write_csv(tmp_path / "one.csv", header, FREQUENCY, ONES, x.real, x.imag, ONES)
    campaign, manifest = drafted(tmp_path)
    assert not any("dead" in sensor["name"] for sensor in manifest["sensor"])
    assert any("dead" in sentence for sentence in campaign.draft.left_out)


@pytest.mark.parametrize(
    ("header", "factor", "why"), [("mid [m]", np.nan, "no value"), ("mid [furlong]", 1.0, "furlong")]
)
def test_a_channel_without_values_or_with_an_unknown_unit_is_left_out_by_name_and_the_others_stay(
    tmp_path: Path, header: str, factor: float, why: str
) -> None:
    size = np.abs(receptance(FREQUENCY))
    write_csv(tmp_path / "sine.csv", f"freq [Hz],force [N],tip [m],{header}", FREQUENCY, ONES, size, factor * size)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["tip displacement"]
    assert any(header in sentence and why in sentence for sentence in campaign.draft.left_out)


@pytest.mark.parametrize("clips", [True, False])
def test_a_force_that_is_not_the_one_in_the_name_of_its_file_is_suspected(tmp_path: Path, clips: bool) -> None:
    force = (8.0 if clips else 10.0) * ONES
    write_csv(
        tmp_path / "sweep_10N.csv", "freq [Hz],force [N],tip [m]", FREQUENCY, force, np.abs(receptance(FREQUENCY))
    )
    campaign, _ = drafted(tmp_path)
    assert any('"10N" in the name' in sentence and "8 N" in sentence for sentence in campaign.suspicions) == clips


@pytest.mark.parametrize(
    ("forces", "said"),
    [
        ((0.1124, 0.6744, 2.248), ["each of 3 runs", "is the force in lbf instead of N"]),
        ((0.354, 2.12, 7.07), ["each of 3 runs", "is the force rms and the level in the name peak"]),
        (
            (0.5, 10.0, 3.0),
            ['named "10N": are the names of levels exchanged', 'named "3N": are the names of levels exchanged'],
        ),
        ((0.5, 3.0, 8.0), ["sweep_10N.csv", "8 N: did the drive clip"]),
        ((0.5, 3.0, 3.0), ["sweep_10N.csv", "3 N: did the drive clip"]),
        ((0.5, 3.0, 10.0), []),
        ((0.4, 2.4, 8.0), ["0.4 N: did the drive clip", "2.4 N: did the drive clip", "8 N: did the drive clip"]),
        ((0.15, 0.9, 3.0), ["0.3 times the level in its name", "is the sensitivity of the force right"]),
    ],
)
def test_forces_of_runs_tell_what_is_wrong_with_the_levels_in_their_names(
    tmp_path: Path, forces: tuple[float, ...], said: list[str]
) -> None:
    tip = np.abs(receptance(FREQUENCY))
    for name, force in zip(("0p5N", "3N", "10N"), forces, strict=True):
        write_csv(tmp_path / f"sweep_{name}.csv", "freq [Hz],force [N],tip [m]", FREQUENCY, force * ONES, force * tip)
    sentences = [
        sentence for sentence in drafted(tmp_path)[0].suspicions if "measured force is used" in sentence.lower()
    ]
    assert all(any(words in sentence for sentence in sentences) for words in said)
    each = sum("exchanged" in words or "clip" in words for words in said)
    assert len(sentences) == (each or min(len(said), 1))


def test_a_run_without_a_force_has_no_level_to_compare(tmp_path: Path) -> None:
    for name in ("0N", "10N"):
        write_csv(
            tmp_path / f"sweep_{name}.csv",
            "freq [Hz],force [N],tip [m]",
            FREQUENCY,
            ONES,
            np.abs(receptance(FREQUENCY)),
        )
    sentences = drafted(tmp_path)[0].suspicions
    assert any('"10N" in the name' in sentence for sentence in sentences)
    assert not any('"0N"' in sentence for sentence in sentences)


@pytest.mark.parametrize("clips", ["force", "tip"])
def test_a_channel_over_time_that_clips_is_suspected_by_its_name(tmp_path: Path, clips: str) -> None:
    time = np.arange(0, 2, 1 / 2048)
    cosine = np.cos(2 * np.pi * 20.3 * time)
    values = {"force": 10 * cosine, "tip": 1e-6 * cosine}
    values[clips] = np.clip(values[clips], -0.8 * values[clips].max(), 0.8 * values[clips].max())
    write_csv(tmp_path / "sine.csv", "time [s],force [N],tip [m]", time, values["force"], values["tip"])
    campaign, _ = drafted(tmp_path)
    assert any(clips in sentence and "clip" in sentence for sentence in campaign.suspicions)
    assert not any("channel 0" in sentence for sentence in campaign.suspicions)
    if clips == "tip":
        assert any(
            'sensor "tip displacement"' in sentence and "clipped" in sentence for sentence in campaign.suspicions
        )


@pytest.mark.parametrize("lag", [5.0, 60.0, 90.0, 175.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_drive_that_clips_is_a_steady_state_and_no_loop(tmp_path: Path, lag: float, noise: float) -> None:
    time, rng = np.arange(0, 2, 1 / 2048), np.random.default_rng(5)
    angle = 2 * np.pi * 20.3 * time
    force = 10 * np.clip(np.cos(angle), -0.8, 0.8) + 10 * noise * rng.normal(size=len(time))
    tip = 1e-6 * np.cos(angle - np.radians(lag)) + 1e-6 * noise * rng.normal(size=len(time))
    write_csv(tmp_path / "sine.csv", "time [s],force [N],tip [m]", time, force, tip)
    campaign, manifest = drafted(tmp_path)
    assert "loop" not in manifest
    assert set(manifest["run"][0]["columns"]) == {"time", "force", "tip displacement"}
    assert any('"force [N]"' in sentence and "the drive clip" in sentence for sentence in campaign.suspicions)


@pytest.mark.parametrize("limit", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("spring", [0.0, 0.3])
def test_a_friction_slider_is_a_loop_also_without_a_name(tmp_path: Path, limit: float, spring: float) -> None:
    time = np.arange(0, 2, 1 / 2048)
    x, slider, force = np.cos(2 * np.pi * 20.3 * time), 0.0, []
    for value in x:  # an elastic spring in series with a slider, and a spring beside them
        slider += np.sign(value - slider) * max(abs(value - slider) - limit, 0.0)
        force.append(value - slider + spring * value)
    noise = 0.01 * np.random.default_rng(6).normal(size=(2, len(time)))
    write_csv(tmp_path / "one.csv", "time [s],force [N],tip [mm]", time, np.array(force) + noise[0], x + noise[1])
    _, manifest = drafted(tmp_path)
    assert len(manifest["loop"]) == 1


def test_a_force_that_drops_near_a_resonance_leaves_one_run(tmp_path: Path) -> None:
    frequency = np.concatenate([FREQUENCY, FREQUENCY[::-1]])
    force = np.where(np.abs(frequency - 100) < 4, 7.0, 10.0)
    x = force * receptance(frequency)
    write_csv(tmp_path / "sine.csv", "f [Hz],F [N],re [m],im [m]", frequency, force, x.real, x.imag)
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 1
    np.testing.assert_array_equal(np.unique(read_campaign(tmp_path).measurement.force), [7.0, 10.0])
    assert any("from 7 to 10" in sentence for sentence in campaign.suspicions)


def test_levels_are_apart_in_any_order_of_the_rows(tmp_path: Path) -> None:
    force, frequency = np.repeat([1.0, 2.0], 41), np.tile(FREQUENCY, 2)
    for order in (np.arange(82), np.lexsort([force, frequency]), np.random.default_rng(8).permutation(82)):
        x = (force * np.abs(receptance(frequency)))[order]
        write_csv(tmp_path / "sine.csv", "f [Hz],F [N],tip [m]", frequency[order], force[order], x)
        draft = draft_campaign(read_folder(tmp_path), Assumptions())
        assert sorted(run["level"] for run in draft.entries["run"]) == [1.0, 2.0]


def test_a_force_that_steps_while_the_time_goes_on_leaves_one_record(tmp_path: Path) -> None:
    time = np.arange(2000) / 1000
    x = np.where(time < 1, 1.0, 1.0 + np.exp(-5 * time) * np.sin(300 * time))
    write_csv(tmp_path / "step.csv", "time [s],F [N],tip [m]", time, np.where(time < 1, 5.0, 0.0), x)
    draft = draft_campaign(read_folder(tmp_path), Assumptions())
    assert sum(len(entries) for kind, entries in draft.entries.items() if kind in {"run", "record", "loop"}) == 1


def test_files_with_another_drive_than_most_are_left_out(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    for number in (1, 2):
        write_csv(
            tmp_path / f"force_{number}.csv", "f [Hz],F [N],re [m],im [m]", FREQUENCY, number * ONES, x.real, x.imag
        )
    write_csv(tmp_path / "sweep_2V.csv", "freq,reading", FREQUENCY, np.abs(x))
    header = "frequency [Hz],base acceleration [m/s^2],tip amplitude [m/s^2]"
    write_csv(tmp_path / "base.csv", header, FREQUENCY, np.where(FREQUENCY < 100, 1.0, 2.0), np.abs(x))
    campaign, manifest = drafted(tmp_path)
    assert {run["file"] for run in manifest["run"]} == {"force_1.csv", "force_2.csv"}
    assert manifest["units"]["level"] == "N"
    assert sum("a campaign has one drive" in sentence for sentence in campaign.draft.left_out) == 2


def test_steps_of_the_acceleration_of_a_base_are_its_levels(tmp_path: Path) -> None:
    size = np.abs(receptance(np.tile(FREQUENCY, 2)))
    header = "frequency [Hz],base acceleration [m/s^2],tip amplitude [m/s^2]"
    write_csv(tmp_path / "base.csv", header, np.tile(FREQUENCY, 2), np.repeat([1.0, 2.0], 41), size)
    _, manifest = drafted(tmp_path)
    assert manifest["drive"]["quantity"] == "base acceleration"
    assert read_campaign(tmp_path).levels.tolist() == [1.0, 2.0]


def test_all_files_that_are_of_no_use_are_named(tmp_path: Path) -> None:
    time = np.arange(400) / 1000
    rows = "\n".join(
        f"{t:.4f},{x:.6f}" for t, x in zip(time, np.sin(300 * time) + 0.1 * np.cos(77 * time), strict=True)
    )
    (tmp_path / "microphone.csv").write_text(f"time [s],mic [Pa]\n{rows}\n", encoding="utf-8")
    lines = "\n".join(f"{k},{(7 * k) % 5}" for k in range(40))
    (tmp_path / "parts.csv").write_text(f"part,colour\n{lines}\n", encoding="utf-8")
    with pytest.raises(CampaignError, match=r"(?s)microphone.*Pa.*parts\.csv"):
        write_manifest(measured := read_folder(tmp_path), draft_campaign(measured, Assumptions()))


def test_sweeps_of_files_that_are_called_free_are_a_test_without_contacts(tmp_path: Path) -> None:
    for name, top in (("free_1N", 90.0), ("jointed_1N", 100.0), ("jointed_2N", 99.0)):
        x = receptance(FREQUENCY, top, 0.02)
        write_csv(
            tmp_path / f"{name}.csv", "f [Hz],force [N],x re [m],x im [m]", FREQUENCY, 0 * x.real + 1, x.real, x.imag
        )
    _, manifest = drafted(tmp_path)
    assert {test["configuration"] for test in manifest["test"] if "free" in test["name"]} == {"free"}
    assert {test["configuration"] for test in manifest["test"] if "jointed" in test["name"]} == {"jointed"}
    runs = {run["file"]: run["test"] for run in manifest["run"]}
    assert runs["jointed_1N.csv"] == runs["jointed_2N.csv"] != runs["free_1N.csv"]
