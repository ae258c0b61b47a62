"""Histories over time in drafted campaigns: records, loops, ring-downs and steady states."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from correlation.campaign.read_campaign import read_campaign
from study.campaign.new_campaign import draft_campaign, read_folder
from study.campaign.question import Assumptions
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv, write_histories


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


def test_a_recording_without_a_unit_is_no_displacement_of_kilometres(tmp_path: Path) -> None:
    time = np.arange(4000) / 2000
    wave = 3e4 * np.exp(-2 * time) * np.cos(2 * np.pi * 32 * time)
    scipy.io.wavfile.write(tmp_path / "release.wav", 2000, wave.astype(np.int16))
    assert any("raw values of a recorder" in sentence for sentence in drafted(tmp_path)[0].suspicions)


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


def test_a_force_that_steps_while_the_time_goes_on_leaves_one_record(tmp_path: Path) -> None:
    time = np.arange(2000) / 1000
    x = np.where(time < 1, 1.0, 1.0 + np.exp(-5 * time) * np.sin(300 * time))
    write_csv(tmp_path / "step.csv", "time [s],F [N],tip [m]", time, np.where(time < 1, 5.0, 0.0), x)
    draft = draft_campaign(read_folder(tmp_path), Assumptions())
    assert sum(len(entries) for kind, entries in draft.entries.items() if kind in {"run", "record", "loop"}) == 1


def test_slow_cycles_of_force_and_displacement_without_a_time_are_loops(tmp_path: Path) -> None:
    angle = 2 * np.pi * np.arange(4000) / 400
    moved = np.where(angle < 10 * np.pi, 5.0, 10.0) * np.sin(angle)
    write_csv(tmp_path / "cycles.csv", "Force (kN),Displacement (mm)", 3.0 * np.cos(angle) + moved, moved)
    _, manifest = drafted(tmp_path)
    (loop,) = manifest["loop"]
    assert loop["frequency"] == "1 Hz"
    plateaus = read_campaign(tmp_path).data[0].loops.plateaus  # type: ignore[attr-defined]
    # The largest of 400 samples of a period is the amplitude within 1 - cos(pi / 400).
    assert [plateau.amplitude[0] for plateau in plateaus] == pytest.approx([5e-3, 10e-3], rel=1e-4)


def test_noise_of_force_and_displacement_without_a_time_is_a_record(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=(2, 4000))
    write_csv(tmp_path / "noise.csv", "Force (N),Displacement (mm)", *noise)
    _, manifest = drafted(tmp_path)
    assert set(manifest) & {"loop", "record"} == {"record"}


def write_bench(path: Path, time: str, instants: list[str]) -> None:
    """Cycles of a dashpot whose force grows faster than the velocity, with pauses, as a bench writes them."""
    turn = np.arange(len(instants)) / 250
    moving = turn % 5 < 4
    moved = 30e-3 + 18e-3 * np.where(moving, np.cos(2 * np.pi * turn), 1.0)
    velocity = np.where(moving, -np.sin(2 * np.pi * turn), 0.0)
    force = 200 * velocity * (1 + np.abs(velocity))
    columns = [instants, 5e-3 * force, force, 0.1 + 50 * moved, 1e3 * moved, 1.0 + 0 * force, 26.0 + 0 * force]
    header = "Force (V),Force (N),Displacement (V),Displacement (mm),Temperature (V),Temperature (C)"
    write_csv(path, f"{time},{header}", *columns)


def test_slow_cycles_of_a_bench_are_loops_whose_volts_and_temperatures_are_left_out(tmp_path: Path) -> None:
    instants = [f"2025-11-14 20:{7 + row // 15000:02d}:{row / 250 % 60:09.6f}" for row in range(4000)]
    write_bench(tmp_path / "t1_2.csv", "Timestamp", instants)
    _, manifest = drafted(tmp_path)
    (loop,) = manifest["loop"]
    assert loop["columns"] == {"displacement": "Displacement (mm)", "force": "Force (N)"}
    assert float(loop["frequency"].split()[0]) == pytest.approx(1.0, rel=0.05)  # to a line of the spectrum, 1/16 Hz
    assert "sensor" not in manifest
    assert "record" not in manifest


def test_random_vibration_with_a_force_stays_a_record(tmp_path: Path) -> None:
    noise = np.random.default_rng(5).standard_normal((2, 4096))
    write_csv(tmp_path / "noise.csv", "time [s],F [N],x [mm]", np.arange(4096) / 250, *noise)
    _, manifest = drafted(tmp_path)
    assert len(manifest["record"]) == 1


def test_levels_of_a_shaker_in_one_record_are_no_loops(tmp_path: Path) -> None:
    time = np.arange(8192) / 1024
    level = 1 + np.floor(time / 2)
    force = level * (np.sin(2 * np.pi * 32 * time) + 0.05 * np.sin(2 * np.pi * 96 * time))
    write_csv(tmp_path / "dwell.csv", "time [s],F [N],x [mm]", time, force, level * np.cos(2 * np.pi * 32 * time))
    _, manifest = drafted(tmp_path)
    assert "loop" not in manifest


def test_a_temperature_in_volts_is_no_motion(tmp_path: Path) -> None:
    noise = np.random.default_rng(5).standard_normal((3, 4096))
    write_csv(tmp_path / "noise.csv", "time [s],F [N],acc [m/s^2],Temperature (V)", np.arange(4096) / 250, *noise)
    _, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["acc [m/s^2]"]


def write_decays(path: Path, *names: str) -> None:
    """Decays of equal channels in the groups of a file."""
    time = np.arange(2000) / 500
    decay = np.exp(-2 * time) * np.cos(2 * np.pi * 7 * time)
    with h5py.File(path, "w") as file:
        for name in names:
            file[f"{name}/time"], file[f"{name}/acc"] = time, decay


def test_decays_of_equal_names_are_numbered(tmp_path: Path) -> None:
    time = np.arange(2000) / 500
    cells = np.empty((2, 2), dtype=object)
    for row in range(2):
        cells[row, 0], cells[row, 1] = time, (1 + row) * np.exp(-2 * time) * np.cos(2 * np.pi * 7 * time)
    scipy.io.savemat(tmp_path / "decay.mat", {"xData": cells})
    first, second = (decay["name"] for decay in drafted(tmp_path)[1]["ring_down"])
    assert second == f"{first} 2"


@pytest.mark.parametrize(
    ("groups", "suspected"), [(("Fe", "Al"), True), (("run_1", "run_2"), False), (("free", "free_2"), False)]
)
def test_groups_that_may_be_of_two_structures_are_suspected(
    tmp_path: Path, groups: tuple[str, ...], suspected: bool
) -> None:
    write_decays(tmp_path / "decay.h5", *groups)
    campaign, _ = drafted(tmp_path)
    assert any("separate campaign of each" in sentence for sentence in campaign.suspicions) == suspected


def test_a_measured_acceleration_of_the_base_drives_and_not_the_voltage_of_its_shaker(tmp_path: Path) -> None:
    time = np.arange(4096) / 1024
    sine = np.sin(2 * np.pi * 16 * time)
    header = "time [s],acc_base [g],voltage [V],vel_tip [m/s]"
    write_csv(tmp_path / "steady.csv", header, time, 0.3 * sine, 0.1 * sine, np.cos(2 * np.pi * 16 * time))
    campaign, manifest = drafted(tmp_path)
    assert manifest["drive"]["quantity"] == "base acceleration"
    assert manifest["run"][0]["columns"]["force"] == "acc_base [g]"
    assert any('"voltage [V]" is not used' in sentence for sentence in campaign.draft.left_out)
