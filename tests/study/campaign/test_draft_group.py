"""Runs in files and groups: level, frequency and repeat by names or attributes, one set of sensors, nothing lost."""

import tomllib
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.read_campaign import read_campaign
from study.campaign.new_campaign import NewCampaign, draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions
from study.campaign.run_name import find_frequency_in_name, find_last_number, make_naming_scheme, repeat_in_name

#: Samples [Hz] and number of samples of a dwell.
RATE, SAMPLES = 2000.0, 2000
LEVELS, REPEATS, DWELLS = (0.5, 3.0), (1, 2), (79.2, 80.1, 81.9)
SWEEP = np.concatenate([np.linspace(70.0, 90.0, 14), np.linspace(90.0, 70.0, 14)])


def response(frequency: Any) -> Any:
    """Of 1 kg at 80 Hz with 1 % of damping [m/s^2 per N]."""
    ratio = np.asarray(frequency) / 80.0
    return -(ratio**2) / (1 - ratio**2 + 0.02j * ratio)


def drafted(folder: Path) -> tuple[NewCampaign, dict[str, Any]]:
    measured = read_folder(folder, overwrite=True)
    campaign = write_manifest(measured, draft_campaign(measured, Assumptions()))
    return campaign, tomllib.loads(campaign.path.read_text())


def dwell(frequency: float, level: float, chatter: float = 0.0, seed: int = 0) -> dict[str, NDArray[np.float64]]:
    """Force and acceleration of one steady state; chatter is noise relative to the latter's amplitude."""
    rng = np.random.default_rng(seed)
    time = np.arange(SAMPLES) / RATE
    wave = np.exp(2j * np.pi * frequency * time)
    force = level * (1 + 0.01 * rng.standard_normal())
    motion = force * response(frequency)
    noise = chatter * np.abs(motion) * rng.standard_normal(SAMPLES)
    return {"Force": (force * wave).real, "Acc": (motion * wave).real + noise, "Acc2": (0.5 * motion * wave).real}


def write_tdms(path: Path, groups: dict[str, dict[str, NDArray[np.float64]]]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    units = {"Force": "N", "Acc": "m/s^2", "Acc2": "m/s^2"}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject(
                    group, name, values, {"wf_increment": 1 / RATE, "wf_start_offset": 0.0, "unit_string": units[name]}
                )
                for group, channels in groups.items()
                for name, values in channels.items()
            ]
        )


def states(folder: Path) -> set[tuple[float, float, int]]:
    """Level, frequency [Hz] and repeat of each steady state of a campaign."""
    table = read_campaign(folder).measurement
    return {
        (level, round(frequency, 1), repeat)
        for level, frequency, repeat in zip(
            table.level.tolist(), table.frequency.tolist(), table.repeat.tolist(), strict=True
        )
    }


def dwells() -> Iterator[tuple[float, float, int]]:
    return product(LEVELS, DWELLS, REPEATS)


@pytest.mark.parametrize("layout", ["a file per dwell", "a group per dwell"])
def test_dwells_of_one_naming_scheme_are_states_of_one_set_of_sensors(tmp_path: Path, layout: str) -> None:
    groups: dict[str, dict[str, Any]] = {}
    for seed, (level, frequency, repeat) in enumerate(dwells()):
        # Near its resonance a joint may chatter, so that a history by itself is no steady state.
        values = dwell(frequency, level, chatter=0.5 if frequency == 80.1 else 0.003, seed=seed)
        if layout == "a file per dwell":
            groups[f"dwell_{level:g}N_{frequency:.2f}Hz_rep{repeat}"] = {"Log": values}
        else:
            groups.setdefault(f"dwell_{level:g}N_rep{repeat}", {})[f"{frequency:.2f} Hz"] = values
    for name, content in groups.items():
        write_tdms(tmp_path / f"{name}.tdms", content)
    campaign, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("sensor", "test", "run")] == [2, 1, len([*dwells()])]
    assert "record" not in manifest
    assert not campaign.draft.left_out
    assert states(tmp_path) == {*dwells()}
    # The table of columns has a block for dwells that are steady by themselves, and one for the others.
    assert sum(bool(note.file) for note in campaign.draft.notes) == 2


def test_a_name_that_contradicts_the_data_is_suspected_and_not_used(tmp_path: Path) -> None:
    for number, (frequency, level) in enumerate([(79.2, 0.5), (80.1, 0.5), (95.0, 0.5), (81.9, 2.0)]):
        called = 80.7 if frequency == 95.0 else frequency
        write_tdms(tmp_path / f"d_0.5N_{called}Hz.tdms", {"Log": dwell(frequency, level, 0.003, number)})
    campaign, _ = drafted(tmp_path)
    measured = {frequency: level for level, frequency, _ in states(tmp_path)}
    assert [measured[frequency] for frequency in (79.2, 80.1, 95.0)] == [0.5, 0.5, 0.5]
    assert measured[81.9] == pytest.approx(2.0, rel=0.03)  # the force scatters by 1 %
    assert any("80.7 Hz in its name" in sentence and "95" in sentence for sentence in campaign.suspicions)
    assert any('"0.5N" in the name' in sentence and "81.9Hz" in sentence for sentence in campaign.suspicions)


def test_a_record_at_another_frequency_than_its_name_stays_a_record(tmp_path: Path) -> None:
    for number, frequency in enumerate((79.2, 80.1, 81.9)):
        chatter, called = (0.5, 88.0) if number == 2 else (0.003, frequency)
        write_tdms(tmp_path / f"d_3N_{called}Hz.tdms", {"Log": dwell(frequency, 3.0, chatter, number)})
    _, manifest = drafted(tmp_path)
    assert [run["file"] for run in manifest["run"]] == ["d_3N_79.2Hz.tdms", "d_3N_80.1Hz.tdms"]
    assert [record["file"] for record in manifest["record"]] == ["d_3N_88.0Hz.tdms"]


def test_groups_of_places_with_one_force_are_no_runs(tmp_path: Path) -> None:
    values = dwell(80.1, 3.0)
    groups = {"drive": {"Force": values["Force"]}, "tip": {"Acc": values["Acc"]}, "root": {"Acc": values["Acc2"]}}
    write_tdms(tmp_path / "state.tdms", groups)
    _, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 1
    assert len(manifest["sensor"]) == 2


@pytest.mark.parametrize(("low", "high"), [(0.4995, 0.5005), (4915.1, 4915.5)])
def test_amplitudes_of_one_set_point_over_time_are_one_level(tmp_path: Path, low: float, high: float) -> None:
    time = np.arange(SAMPLES) / RATE
    for number, level in enumerate((low, high, 3 * low)):
        wave = level * np.exp(2j * np.pi * DWELLS[number] * time)
        rows = np.column_stack([time, wave.real, (response(DWELLS[number]) * wave).real])
        np.savetxt(tmp_path / f"{number}.csv", rows, delimiter=",", header="t [s],F [N],a [m/s^2]", comments="")
    drafted(tmp_path)
    assert len({level for level, _, _ in states(tmp_path)}) == 2


def write_sweep(group: h5py.Group, level: float, rows: slice, seed: int) -> None:
    rng = np.random.default_rng(seed)
    force = level * (1 + 0.01 * rng.standard_normal())
    columns = {"frequency": SWEEP[rows], "force": force + 0 * SWEEP[rows], "acc": force * response(SWEEP[rows])}
    for (name, values), unit in zip(columns.items(), ("Hz", "N", "m/s^2"), strict=True):
        group.create_dataset(name, data=values).attrs["unit"] = unit


@pytest.mark.parametrize(
    "name", ["level_{level:g}N/rep{repeat}/{way}", "{way}/{level:g}N_{repeat}", "run_{number:03}", "{number}/{way}"]
)
def test_nested_groups_and_attributes_are_read_as_flat_names(tmp_path: Path, name: str) -> None:
    with h5py.File(tmp_path / "sine.h5", "w") as file:
        for number, (level, repeat) in enumerate(product((0.5, 3.0, 10.0), (1, 2, 3)), start=1):
            for way, rows in (("up", slice(14)), ("down", slice(14, 28))):
                group = file.require_group(name.format(level=level, repeat=repeat, number=number, way=way))
                if "level" not in name:
                    (group.parent if name == "{number}/{way}" else group).attrs.update(level_N=level, repeat=repeat)
                if name == "run_{number:03}":
                    write_sweep(group, level, slice(28), number)
                    break
                write_sweep(group, level, rows, number)
    _, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 1
    table = read_campaign(tmp_path).measurement
    kinds = {*zip(table.level.tolist(), table.repeat.tolist(), table.sweep.tolist(), strict=True)}
    assert kinds == {*product((0.5, 3.0, 10.0), (1, 2, 3), (1, -1))}


def test_segments_of_a_labview_file_are_runs(tmp_path: Path) -> None:
    text = "LabVIEW Measurement\n***End_of_Header***\n\n"
    for level in (1.0, 3.0):
        channels = dwell(80.0, level)
        text += "Channels\t2\nY_Unit_Label\tN\tm/s^2\nX0\t0\t0\nDelta_X\t5e-4\t5e-4\n***End_of_Header***\n"
        text += "X_Value\tForce\tAcc\n"
        pairs = zip(channels["Force"], channels["Acc"], strict=True)
        text += "".join(f"\t{force:.9g}\t{acc:.9g}\n" for force, acc in pairs)
    (tmp_path / "dwell.lvm").write_text(text)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("sensor", "test", "run")] == [1, 1, 2]
    assert [(level, frequency) for level, frequency, _ in sorted(states(tmp_path))] == [(1.0, 80.0), (3.0, 80.0)]


def test_an_attribute_that_is_not_near_the_force_is_no_level(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "sine.h5", "w") as file:
        for number, level in enumerate((4.0, 40.0), start=1):
            group = file.create_group(f"run_{number}")
            group.attrs["level"] = number
            write_sweep(group, level, slice(28), number)
    drafted(tmp_path)
    np.testing.assert_allclose(np.unique(read_campaign(tmp_path).measurement.level), [4.0, 40.0], rtol=0.05)


@pytest.mark.parametrize("name", ["level_{level:g}N_rep{repeat}", "{level:g}N_{number}"])
@pytest.mark.parametrize("stopped", [(0.5, 1), (3.0, 2), (10.0, 3)])
def test_a_run_that_stopped_early_is_a_repeat_as_any_other(
    tmp_path: Path, name: str, stopped: tuple[float, int]
) -> None:
    with h5py.File(tmp_path / "sine.h5", "w") as file:
        for number, (level, repeat) in enumerate(product((0.5, 3.0, 10.0), (1, 2, 3))):
            group = file.create_group(name.format(level=level, repeat=repeat, number=number))
            write_sweep(group, level, slice(9 if (level, repeat) == stopped else 28), number)
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 9
    assert not campaign.draft.left_out
    assert [run["repeat"] for run in manifest["run"] if run["level"] == stopped[0]] == [1, 2, 3]


def test_of_two_runs_with_the_same_points_only_the_shorter_is_left_out_by_file_and_group(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "sine.h5", "w") as file:
        for group, rows in {"run_2": slice(28), "run_1": slice(9), "run_3": slice(28)}.items():
            table = file.create_group(group)
            write_sweep(table, 3.0 if group != "run_3" else 10.0, rows, seed=0)
            table.create_dataset("repeat", data=np.ones(len(SWEEP[rows])))  # the file says that both are the first
    campaign, manifest = drafted(tmp_path)
    assert [run["columns"]["frequency"] for run in manifest["run"]] == ["run_2/frequency", "run_3/frequency"]
    (left_out,) = campaign.draft.left_out
    assert left_out.startswith('run "sine.h5, run_1": ')
    assert '"sine.h5, run_2"' in left_out
    assert "repeat 1" in left_out


def test_what_names_say_of_a_run() -> None:
    name = "dwell_0.5N_79.80Hz_rep3"
    assert (find_frequency_in_name(name), repeat_in_name(name), find_last_number("sine_2_0.5N_1,2kHz")) == (79.8, 3, 2)
    assert find_frequency_in_name("sweep 1p5 kHz") == 1500.0
    assert repeat_in_name("prep4") is find_frequency_in_name("80 Hzx") is None
    assert {make_naming_scheme(one) for one in (name, "dwell_10N_71.29Hz_rep1", "dwell")} == {"dwell"}
    assert {make_naming_scheme(one) for one in ("level_3N/rep1/up", "level_3N_rep1", "")} == {""}
    assert make_naming_scheme("free/run_1") != make_naming_scheme("jointed/run_1")
