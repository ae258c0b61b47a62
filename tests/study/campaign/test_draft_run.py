"""Runs of drafted campaigns: sweeps, levels and repeats, and what drives."""

import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions, Marked, Question
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv


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
    assert len({text for text in asked if "settling" in text}) == 2
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
    [(2, False, "that of their file names"), (1, False, ""), (2, True, "")],
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


def test_stacked_levels_have_the_measured_force_of_each_sweep(tmp_path: Path) -> None:
    f = np.concatenate([FREQUENCY[::way] for _, way in STACK])
    size = np.concatenate([gain * np.abs(receptance(FREQUENCY[::way])) for gain, way in STACK])
    force = np.repeat([gain for gain, _ in STACK], len(FREQUENCY)) * (1 + 0.001 * np.sin(np.arange(len(f))))
    write_csv(tmp_path / "stack.csv", "f [Hz],force [N],acc tip amplitude [g]", f, force, size)
    _, manifest = drafted(tmp_path)
    assert manifest["run"][0]["levels"] == [1.0, 1.0, 3.0, 3.0, 10.0, 10.0]


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
            ['named "10N": are the names of levels interchanged', 'named "3N": are the names of levels interchanged'],
        ),
        ((0.5, 3.0, 8.0), ["sweep_10N.csv", "8 N: did the drive clip"]),
        ((0.5, 3.0, 3.0), ["sweep_10N.csv", "3 N: did the drive clip"]),
        ((0.5, 3.0, 10.0), []),
        ((0.4, 2.4, 8.0), ["0.4 N: did the drive clip", "2.4 N: did the drive clip", "8 N: did the drive clip"]),
        ((0.15, 0.9, 3.0), ["0.3 times the level in its name", "is the sensitivity of the force sensor correct"]),
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
    item = sum("interchanged" in words or "clip" in words for words in said)
    assert len(sentences) == (item or min(len(said), 1))


@pytest.mark.parametrize(("factor", "suspected"), [(1e3, False), (1.0, True)])
def test_a_force_in_millinewtons_is_compared_with_the_newtons_of_its_name(
    tmp_path: Path, factor: float, suspected: bool
) -> None:
    tip = np.abs(receptance(FREQUENCY))
    for level in (3, 10):
        values = (FREQUENCY, factor * level * ONES, level * tip)
        write_csv(tmp_path / f"sweep_{level}N.csv", "freq [Hz],force [mN],tip [m]", *values)
    sentences = drafted(tmp_path)[0].suspicions
    assert any("is the force in N instead of mN" in sentence for sentence in sentences) == suspected
    assert {*read_campaign(tmp_path).measurement.level.tolist()} == {1e-3 * factor * level for level in (3, 10)}


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
