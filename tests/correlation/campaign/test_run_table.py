"""Runs of a manifest: the columns of a measured file become steady states in SI and in one convention."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, Measurement
from correlation.campaign.passes import count_repeats, find_passes
from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from correlation.family.level_order import find_earlier_levels
from correlation.feature.observation import find_sweep_directions

HEAD = """schema = 1
[convention]
time = "{time}"
amplitude = "{amplitude}"
[units]
level = "{level}"
frequency = "Hz"
{drive}
[[sensor]]
name = "tip"
quantity = "acceleration"
direction = "z"
place = "tip"
{sensor}
[[test]]
name = "stepped"
configuration = "jointed"
"""
DEFAULT = {"time": "exp(+i omega t)", "amplitude": "peak", "level": "N", "drive": "", "sensor": ""}


def write(folder: Path, table: str, run: str, columns: str, **head: str) -> Path:
    (folder / "data.csv").write_text(table, encoding="utf-8")
    manifest = HEAD.format(**(DEFAULT | head)) + f'[[run]]\ntest = "stepped"\nfile = "data.csv"\n{run}\n[run.columns]\n'
    (folder / "campaign.toml").write_text(manifest + columns, encoding="utf-8")
    return folder


def read(*arguments: Path | str, **head: str) -> Measurement:
    return read_campaign(write(*arguments, **head)).measurement  # type: ignore[arg-type]


AMPLITUDES = 'frequency = "f"\ntip = { amplitude = "a", phase = "p", unit = "g_n", phase_unit = "deg" }\n'


def test_amplitude_and_phase_in_other_units_become_complex_si(tmp_path: Path) -> None:
    table = read(tmp_path, "f,a,p\n10,2,90\n11,1,180\n", "level = 3.0", AMPLITUDES)
    # 1 g_n is 9.80665 m/s^2 by definition.
    assert table.value == pytest.approx([2 * 9.80665j, -9.80665], abs=1e-12)
    assert table.level == pytest.approx([3, 3])
    assert table.sweep.tolist() == [1, 1]
    assert table.force == pytest.approx(table.level)


def test_the_other_time_sign_and_rms_values_are_converted(tmp_path: Path) -> None:
    table = read(tmp_path, "f,a,p\n10,2,90\n11,1,180\n", "level = 3.0", AMPLITUDES,
                 time="exp(-i omega t)", amplitude="rms")  # fmt: skip
    assert table.value == pytest.approx(np.sqrt(2) * np.array([-2 * 9.80665j, -9.80665]), abs=1e-12)
    assert table.level == pytest.approx(np.full(2, 3 * np.sqrt(2)))


def test_phases_count_from_the_measured_force(tmp_path: Path) -> None:
    columns = 'frequency = "f"\nforce = { amplitude = "F", phase = "q", unit = "mN", phase_unit = "rad" }\n'
    columns += 'tip = { amplitude = "a", phase = "p", unit = "m/s^2", phase_unit = "rad" }\n'
    table = read(tmp_path, "f,F,q,a,p\n10,1990,0.3,2,0.5\n11,2010,0.4,2,0.1\n", "level = 2.0", columns)
    assert table.value == pytest.approx(2 * np.exp([0.2j, -0.3j]))
    assert table.force == pytest.approx([1.99, 2.01])
    assert table.level == pytest.approx([2, 2])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"acceleration"', '"aceleration"', r'sensor\[1\]\.quantity = "aceleration": .*did you mean "acceleration"\?'),
        ('"jointed"', '"joint"', r'test\[1\]\.configuration = "joint": .*did you mean "jointed"\?'),
    ],
)
def test_a_run_is_no_mistake_for_the_mistake_of_what_it_names(tmp_path: Path, old: str, new: str, message: str) -> None:
    manifest = write(tmp_path, "f,a,p\n10,2,90\n", "level = 3.0", AMPLITUDES) / "campaign.toml"
    manifest.write_text(manifest.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CampaignError, match=message) as caught:
        read_campaign(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_response_controlled_run_has_the_median_force_as_its_level(tmp_path: Path) -> None:
    columns = 'frequency = "f"\nforce = { column = "F", unit = "N" }\ntip = { column = "a", unit = "m/s^2" }\n'
    table = read(tmp_path, "f,F,a\n10,3,5\n11,1.2345,5\n12,2,5.01\n", 'control = "response"', columns)
    assert table.level == pytest.approx([2, 2, 2])
    assert table.force == pytest.approx([3, 1.2345, 2])


@pytest.mark.parametrize(("control", "suspected"), [("force", True), ("response", False)])
def test_a_force_that_differs_under_response_control_does_not_clip(
    tmp_path: Path, control: str, suspected: bool
) -> None:
    # Twice the response of a joint that slips needs less than twice the force.
    columns = 'frequency = "f"\nforce = { column = "F", unit = "N" }\ntip = { column = "a", unit = "m/s^2" }\n'
    text = "f,F,a,n\n10,1.1,5,1\n11,1,5,1\n12,1,5.01,1\n10,1.5,10,2\n11,1.4,10,2\n12,1.2,10.01,2\n"
    folder = write(tmp_path, text, f'level = 1.0\ncontrol = "{control}"\nrows = {{ n = 1.0 }}', columns)
    campaign = read_campaign(run_again(folder, ("= 1.0", "= 2.0")))
    assert [test.control for test in campaign.tests] == [control]
    assert any("does the drive clip" in str(item) for item in campaign.suspicions) == suspected


def test_a_file_of_passes_up_and_down_has_sweeps_and_repeats(tmp_path: Path) -> None:
    rows = "".join(f"{f},{f},0\n" for f in (10, 11, 12, 11, 10, 11, 12))
    table = read(tmp_path, "f,a,p\n" + rows, "level = 3.0", AMPLITUDES)
    by_order = np.argsort(table.order)
    assert table.frequency[by_order].tolist() == [10, 11, 12, 11, 10, 11, 12]
    assert table.sweep[by_order].tolist() == [1, 1, 1, -1, -1, 1, 1]
    assert table.repeat[by_order].tolist() == [1, 1, 1, 1, 1, 2, 2]


def test_a_sweep_that_is_stated_is_in_the_order_of_its_direction_however_a_table_lists_it(tmp_path: Path) -> None:
    """One column of frequencies stands beside columns of both directions."""
    write(tmp_path, "f,a,p\n10,1,0\n11,1.5,0\n12,1.2,0\n13,1,0\n", 'level = 3.0\nsweep = "down"', AMPLITUDES)
    campaign = read_campaign(tmp_path)
    table = campaign.measurement
    assert table.frequency[np.argsort(table.order)].tolist() == [13, 12, 11, 10]
    assert not any("exchanged" in item.sentence for item in campaign.suspicions)


def passes(frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sweep and repeat of each row of one level."""
    sweep, _ = find_passes(frequency)
    return sweep, count_repeats(frequency, sweep, np.ones(len(frequency)))


def test_passes_number_readings_at_one_frequency() -> None:
    way, repeat = passes(np.array([5.0, 5.0, 6.0, 6.0, 6.0]))
    assert way.tolist() == [1, 1, 1, 1, 1]
    assert repeat.tolist() == [0, 1, 0, 1, 2]
    way, repeat = passes(np.array([5.0, 5.0]))
    assert way.tolist() == [0, 0]
    assert repeat.tolist() == [0, 1]


def test_passes_take_frequencies_that_differ_by_rounding_alone_as_one() -> None:
    # The counter reads 1e-6 more or less: three readings at 10 Hz and a second pass over 11 Hz.
    way, repeat = passes(np.array([10.0, 10.00001, 9.99999, 11.0, 12.0, 11.0, 10.0, 11.00001]))
    assert way.tolist() == [1, 1, 1, 1, 1, -1, -1, 1]
    assert repeat.tolist() == [0, 1, 2, 0, 0, 0, 0, 1]


def test_a_turning_point_that_is_read_twice_belongs_to_both_sweeps() -> None:
    way, repeat = passes(np.array([10.0, 11.0, 12.0, 12.0, 11.0, 10.0, 10.0, 11.0]))
    assert way.tolist() == [1, 1, 1, -1, -1, -1, 1, 1]
    assert repeat.tolist() == [0, 0, 0, 0, 0, 0, 1, 1]
    # Two readings at each frequency are repeats, also at a turning point; four there are two of each sweep.
    way, repeat = passes(np.repeat([10.0, 11.0, 12.0, 11.0], [2, 2, 2, 2]))
    assert way.tolist() == [1, 1, 1, 1, 1, 1, -1, -1]
    way, repeat = passes(np.repeat([10.0, 11.0, 12.0, 11.0, 10.0], [2, 2, 4, 2, 2]))
    assert way.tolist() == [1] * 6 + [-1] * 6
    assert repeat.tolist() == [0, 1] * 6


def test_a_sweep_that_begins_anew_has_no_point_of_the_other_direction() -> None:
    way, number = find_passes(np.array([10.0, 11.0, 12.0, 10.0, 11.0, 12.0]))
    assert way.tolist() == [1] * 6
    assert number.tolist() == [0, 0, 0, 1, 1, 1]


@pytest.mark.parametrize("factor", [5.0, 1.0])
@pytest.mark.parametrize("falling", [False, True])
def test_branches_that_a_table_lists_one_after_the_other_are_sweeps(
    tmp_path: Path, factor: float, falling: bool
) -> None:
    """The upper branch of a softening resonance is listed by rising frequency, and was swept down; or either first."""
    lower = [(10, 1.0), (11, 1.1), (12, 1.2), (13, 1.3), (14, 1.5)]
    upper = [(11.5, 1.15 * factor), (12.5, 1.25 * factor), (13.5, 1.4 * factor), (15, 1.2), (16, 1.0)]
    listed = [*upper[::-1], *lower[::-1]] if falling else [*lower, *upper]
    write(tmp_path, "f,a,p\n" + "".join(f"{f},{a},0\n" for f, a in listed), "level = 3.0", AMPLITUDES)
    campaign = read_campaign(tmp_path)
    table = campaign.measurement
    by_order = np.argsort(table.order)
    way = table.sweep[by_order]
    told = [item for item in campaign.suspicions if "read as branches" in item.sentence]
    if factor == 1.0:
        assert len(np.unique(way)) == 1
        assert not told
        return
    assert len(told) == 1
    frequency = table.frequency[by_order]
    assert frequency[way == 1].tolist() == [f for f, _ in lower]
    assert frequency[way == -1].tolist() == [f for f, _ in upper[::-1]]
    assert (table.repeat == 1).all()


@pytest.mark.parametrize("way", ["shifted", "stronger"])
def test_a_second_pass_through_a_resonance_is_no_branch(tmp_path: Path, way: str) -> None:
    """Its resonance is 0.3 % higher, or its force is a third larger."""
    rows = []
    for number, frequency in enumerate((np.linspace(90, 110, 41), np.linspace(92, 112, 41))):
        ratio = frequency / (100.3 if number and way == "shifted" else 100.0)
        size = (4 / 3 if number and way == "stronger" else 1.0) / np.abs(1 - ratio**2 + 0.01j * ratio)
        rows += [f"{f},{a},0\n" for f, a in zip(frequency.tolist(), size.tolist(), strict=True)]
    table = read(tmp_path, "f,a,p\n" + "".join(rows), "level = 3.0", AMPLITUDES)
    assert (table.sweep == 1).all()


SWEEPS_OF_TWO_LEVELS = [(10, 1, "up"), (11, 2, "up"), (12, 3, "up"), (12, 3, "down"), (11, 2, "down"), (10, 1, "down")]


@pytest.mark.parametrize("stated", [True, False])
def test_each_sweep_of_a_run_may_have_a_level(tmp_path: Path, stated: bool) -> None:
    rows = [f"{f},{gain * a},0,{way}" for gain in (1, 5) for f, a, way in SWEEPS_OF_TWO_LEVELS]
    columns = AMPLITUDES + ('sweep = "way"\n' if stated else "")
    text = "\n".join(["f,a,p,way", *rows, ""])
    table = read(tmp_path, text, "levels = [2.0, 2.0, 10.0, 10.0]", columns)
    assert sorted(table.level.tolist()) == [2.0] * 6 + [10.0] * 6
    assert set(table.repeat.tolist()) == {1}
    assert (np.abs(table.value) / table.level)[table.frequency == 11] == pytest.approx(np.full(4, 9.80665))
    with pytest.raises(CampaignError, match=r"levels: has 3 numbers, but data\.csv has 4 sweeps: give one for each"):
        read(tmp_path, text, "levels = [2.0, 2.0, 10.0]", columns)
    with pytest.raises(CampaignError, match=r"levels: is for sweeps .* without another level"):
        read(tmp_path, text, "level = 1.0\nlevels = [2.0, 2.0, 10.0, 10.0]", columns)


def test_a_phase_of_a_sensor_without_one_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match='tip: names a phase, but sensor "tip" has phase = false: remove'):
        read(tmp_path, "f,a,p\n10,2,90\n11,1,180\n", "level = 3.0", AMPLITUDES, sensor="phase = false")


def run_again(folder: Path, *changes: tuple[str, str]) -> Path:
    """The campaign with its run once more for each change of it."""
    manifest = folder / "campaign.toml"
    text = manifest.read_text(encoding="utf-8")
    run = text[text.index("[[run]]") :]
    manifest.write_text(text + "".join(run.replace(*change) for change in changes), encoding="utf-8")
    return folder


def test_runs_follow_each_other_in_the_order_of_the_manifest(tmp_path: Path) -> None:
    folder = write(tmp_path, "f,a,p\n12,2,90\n11,1,180\n", "level = 3.0", AMPLITUDES)
    campaign = read_campaign(run_again(folder, ("level = 3.0", 'level = 3.0\nsweep = "up"'), ("3.0", "1.0")))
    table = campaign.measurement
    assert np.sort(table.order).tolist() == [0, 1, 2, 3, 4, 5]
    assert find_sweep_directions(campaign) == (-1, 1)
    # 1 N was measured last: it cannot have dragged anything before 3 N.
    assert find_earlier_levels(campaign, [1.0, 3.0]).tolist() == [[True, True], [False, True]]


def test_a_column_of_orders_is_kept(tmp_path: Path) -> None:
    folder = write(tmp_path, "f,a,p,n\n10,2,90,7\n11,1,180,8\n", "level = 3.0", AMPLITUDES + 'order = "n"\n')
    table = read_campaign(run_again(folder, ("3.0", "1.0"))).measurement
    assert table.order.tolist() == [7, 8, 7, 8]


def test_rows_of_a_file_are_chosen_by_number_and_word(tmp_path: Path) -> None:
    text = "f,a,p,way,level\n10,1,0,up,1\n11,2,0,up,1\n10,3,0,down,1\n10,4,0,up,2\n"
    run = 'level = 1.0\nrows = { way = "up", level = 1.0 }'
    assert abs(read(tmp_path, text, run, AMPLITUDES).value) == pytest.approx([9.80665, 2 * 9.80665])
    with pytest.raises(CampaignError, match=r'"way" of data.csv is never .*sideways.*up, down'):
        read(tmp_path, text, 'level = 1.0\nrows = { way = "sideways" }', AMPLITUDES)


def test_a_sweep_column_of_words_is_taken(tmp_path: Path) -> None:
    text = "f,a,p,way\n10,1,0,up\n11,2,0,up\n10,3,0,down\n11,3,0,down\n"
    table = read(tmp_path, text, "level = 1.0", AMPLITUDES + 'sweep = "way"\n')
    assert table.sweep.tolist() == [-1, 1, -1, 1]


def uncalibrated(tmp_path: Path) -> Campaign:
    columns = 'frequency = "f"\nlevel = "U"\ntip = { amplitude = "a" }\n'
    return read_campaign(write(
        tmp_path, "f,U,a\n10,0.5,1\n11,0.5,2\n", "", columns, level="V",
        drive="[drive]\ncalibrated = false", sensor='calibrated = false\nphase = false\nnoise = "1 %"',
    ))  # fmt: skip


def test_a_drive_in_volts_and_amplitudes_without_phase_are_taken_as_such(tmp_path: Path) -> None:
    campaign = uncalibrated(tmp_path)
    assert (campaign.drive.unit, campaign.drive.calibrated) == ("V", False)
    (sensor,) = campaign.sensors
    assert (sensor.calibrated, sensor.has_phase, sensor.unit, sensor.noise) == (False, False, "V", (0.01, 0.0))
    assert campaign.measurement.value == pytest.approx([1, 2])


def test_a_sensitivity_turns_volts_into_acceleration(tmp_path: Path) -> None:
    columns = 'frequency = "f"\ntip = { real = "a", imag = "b", unit = "mV", sensitivity = "100 mV/g_n" }\n'
    table = read(tmp_path, "f,a,b\n10,200,0\n11,0,-100\n", "level = 1.0", columns)
    assert table.value == pytest.approx([2 * 9.80665, -9.80665j], abs=1e-9)


@pytest.mark.parametrize(
    ("run", "columns", "head", "words"),
    [
        ("level = 1.0", 'frequency = "f"\ntip = "a"\n', {}, ["run[1].columns.tip", '"a"', "no unit"]),
        ("level = 1.0", 'frequency = "g"\ntip = "a"\n', {}, ["data.csv", '"g"']),
        (
            "level = 1.0",
            'frequency = "f"\ntip = { column = "a", sensitivity = "100 mV/g_n" }\n',
            {},
            ["run[1].columns.tip", "no unit", 'unit = "V"'],
        ),
        ("level = 1.0", 'tip = "a"\n', {}, ["run[1].columns.frequency"]),
        ("", 'frequency = "f"\ntip = { column = "a", unit = "m/s^2" }\n', {}, ["run[1].level", "is missing"]),
        ("level = -1.0", 'frequency = "f"\ntip = "a"\n', {}, ["run[1].level = -1.0"]),
        ("level = 1.0", 'frequency = "f"\ntop = "a"\n', {}, ['did you mean "tip"']),
        ("level = 1.0", AMPLITUDES.replace("deg", "grad"), {}, ["phase_unit", "grad"]),
        ("level = 1.0", AMPLITUDES.replace(', phase_unit = "deg"', ""), {}, ["tip", "phase_unit"]),
        ("level = 1.0", AMPLITUDES.replace("g_n", "V"), {}, ["tip", '"V"', "m/s^2"]),
        ("level = 1.0", 'frequency = "f"\ntip = { amplitude = "a", unit = "m/s^2" }\n', {}, ["phase = false"]),
        ('level = 1.0\ncontrol = "response"', AMPLITUDES, {}, ["control", "force"]),
        ("level = 1.0", AMPLITUDES, {"level": "V"}, ["units.level", "calibrated = false"]),
        ("level = 1.0\nrepeat = -2", AMPLITUDES, {}, ["repeat = -2"]),
    ],
)
def test_a_mistake_is_one_sentence_with_its_key(
    tmp_path: Path, run: str, columns: str, head: dict[str, str], words: list[str]
) -> None:
    with pytest.raises(CampaignError) as caught:
        read(tmp_path, "f,a,p\n10,2,90\n11,1,180\n", run, columns, **head)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("size", [8e-275, 1e200])
@pytest.mark.parametrize("key", ["frequency", "level", "force"])
def test_a_size_that_nothing_measures_is_refused_with_its_row(tmp_path: Path, key: str, size: float) -> None:
    values = {"frequency": 10.0, "level": 2.0, "force": 2.0} | {key: size}
    columns = 'frequency = "f"\nlevel = "l"\nforce = "F"\ntip = { column = "a", unit = "m/s^2" }\n'
    rows = "f,l,F,a\n9,2,2,1\n" + ",".join(map(repr, values.values())) + ",1\n"
    with pytest.raises(CampaignError, match=r"at row 2.*damaged") as error:
        read(tmp_path, rows, "", columns)
    assert key in str(error.value)
    assert f"{size:g}" in str(error.value)


def over_time(mean: float) -> str:
    """A file of a second at 20 Hz."""
    time = np.arange(2000) / 2000
    wave = np.cos(2 * np.pi * 20 * time)
    return "t,F,a,b\n" + "".join(f"{t},{2 * x:.9g},{mean + 3 * x:.9g},1\n" for t, x in zip(time, wave, strict=True))


OVER_TIME = 'time = "t"\nforce = { column = "F", unit = "N" }\ntip = { column = "a", unit = "m/s^2" }\n'


def test_a_mean_keeps_its_sign_where_there_is_no_phase(tmp_path: Path) -> None:
    folder = write(tmp_path, over_time(-5.0), "harmonics = 1", OVER_TIME, sensor="phase = false")
    # The mean of an acceleration is the offset of its sensor.
    assert read_campaign(folder).measurement.value.tolist() == pytest.approx([3], abs=1e-6)
    text = (folder / "campaign.toml").read_text(encoding="utf-8").replace('"m/s^2"', '"m"')
    (folder / "campaign.toml").write_text(text.replace('"acceleration"', '"displacement"'), encoding="utf-8")
    assert read_campaign(folder).measurement.value.tolist() == pytest.approx([-5, 3], abs=1e-6)
    columns = (
        'frequency = "f"\ntip = [{ column = "m", harmonic = 0, unit = "m/s^2" }, { amplitude = "a", unit = "m/s^2" }]\n'
    )
    table = read(tmp_path, "f,m,a\n10,-5,3\n", "level = 2.0", columns, sensor="phase = false")
    assert table.value.tolist() == pytest.approx([-5, 3])


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ('level = "b"\n', ["run[1].columns.level", "give level of the run"]),
        ('repeat = "b"\n', ["run[1].columns.repeat", "give repeat of the run"]),
        ('order = "b"\n', ["run[1].columns.order", "remove it"]),
        ('sweep = "b"\n', ["run[1].columns.sweep", "give sweep of the run"]),
        ('tip = [{ column = "a" }, { column = "b", harmonic = 3 }]\n', ["run[1].columns.tip", "harmonics"]),
        ('tip = { column = "a", harmonic = 3 }\n', ["run[1].columns.tip", "harmonics"]),
    ],
)
def test_columns_of_a_stepped_sine_are_refused_beside_the_time(tmp_path: Path, extra: str, words: list[str]) -> None:
    own = OVER_TIME.rsplit("tip", 1)[0] if extra.startswith("tip") else OVER_TIME
    with pytest.raises(CampaignError) as caught:
        read(tmp_path, over_time(0.0), "", own + extra)
    for word in words:
        assert word in str(caught.value)


def test_a_force_over_time_that_nothing_measures_is_refused(tmp_path: Path) -> None:
    time = np.arange(2000) / 1000
    wave = np.cos(2 * np.pi * 20 * time)
    rows = "\n".join(f"{t},{1e-60 * value},{value}" for t, value in zip(time, wave, strict=True))
    columns = 'time = "t"\nforce = "F"\ntip = { column = "a", unit = "m/s^2" }\n'
    with pytest.raises(CampaignError, match=r"force.*damaged"):
        read(tmp_path, f"t,F,a\n{rows}\n", "", columns)


def test_a_response_may_vanish_and_is_no_larger_than_any_reading(tmp_path: Path) -> None:
    columns = 'frequency = "f"\ntip = { real = "re", imag = "im", unit = "m/s^2" }\n'
    assert len(read(tmp_path, "f,re,im\n9,1,1e-200\n10,0,1\n", "level = 2.0", columns)) == 2
    with pytest.raises(CampaignError, match=r'"im" of data.csv is .* at row 1'):
        read(tmp_path, "f,re,im\n9,1,1e200\n10,0,1\n", "level = 2.0", columns)


def test_values_that_are_missing_are_skipped_on_request_alone(tmp_path: Path) -> None:
    text = "f,a,p\n10,2,90\n11,,180\n12,1,0\n"
    with pytest.raises(CampaignError, match=r'"a" of data.csv is not finite at 1 of 3 rows.*row 2.*missing = "skip"'):
        read(tmp_path, text, "level = 1.0", AMPLITUDES)
    assert read(tmp_path, text, 'level = 1.0\nmissing = "skip"', AMPLITUDES).frequency.tolist() == [10, 12]


def test_two_runs_of_one_repeat_are_refused(tmp_path: Path) -> None:
    folder = write(tmp_path, "f,a,p\n10,2,90\n11,1,180\n", "level = 3.0", AMPLITUDES)
    manifest = folder / "campaign.toml"
    text = manifest.read_text(encoding="utf-8")
    second = text[text.index("[[run]]") :]
    manifest.write_text(text + second, encoding="utf-8")
    with pytest.raises(
        CampaignError,
        match=r'run\[2\]: two runs of test "stepped", it and run\[1\], give.*"tip" at 3, 10 Hz as repeat 1',
    ):
        read_campaign(folder)
    manifest.write_text(text + second.replace("level = 3.0", "level = 3.0\nrepeat = 2"), encoding="utf-8")
    assert np.unique(read_campaign(folder).measurement.repeat).tolist() == [1, 2]


def test_frequencies_of_two_runs_that_differ_by_rounding_alone_are_one(tmp_path: Path) -> None:
    rows = "f,a,p,n\n10,2,90,1\n11,1,180,1\n10.00000001,2,90,2\n10.99999999,1,180,2\n"
    folder = write(tmp_path, rows, "level = 3.0\nrows = { n = 1.0 }", AMPLITUDES)
    once = (folder / "campaign.toml").read_text(encoding="utf-8")
    run_again(folder, ("n = 1.0", "n = 2.0"))
    with pytest.raises(CampaignError, match=r'two runs of test "stepped".*"tip" at 3, 10 Hz as repeat 1'):
        read_campaign(folder)
    (folder / "campaign.toml").write_text(once, encoding="utf-8")
    run_again(folder, ("n = 1.0 }", "n = 2.0 }\nrepeat = 2"))
    table = read_campaign(folder).measurement
    assert table.frequency.tolist() == [10.0, 10.0, 10.99999999, 10.99999999]
    assert table.repeat.tolist() == [1, 2, 1, 2]


def test_degrees_that_are_called_radians_are_suspected(tmp_path: Path) -> None:
    rows = "".join(f"{10 + n},2,{-n * 9}\n" for n in range(20))
    columns = AMPLITUDES.replace('phase_unit = "deg"', 'phase_unit = "rad"')
    campaign = read_campaign(write(tmp_path, "f,a,p\n" + rows, "level = 1.0", columns))
    assert any('"p" reaches 171 rad' in str(item) for item in campaign.suspicions)
    campaign = read_campaign(write(tmp_path, "f,a,p\n" + rows, "level = 1.0", AMPLITUDES))
    assert not any("degrees" in str(item) for item in campaign.suspicions)


def test_a_force_that_clips_is_suspected(tmp_path: Path) -> None:
    time = np.arange(0, 1, 1 / 4000)
    pure = 3 * np.cos(2 * np.pi * 50 * time)
    columns = 'time = "t"\nforce = { column = "F", unit = "N" }\ntip = { column = "a", unit = "m/s^2" }\n'
    for force, clips in ((np.clip(pure, -2, 2), True), (pure, False)):
        rows = "".join(
            f"{t:.8f},{f:.8g},{np.cos(2 * np.pi * 50 * t - 0.3):.8g}\n" for t, f in zip(time, force, strict=True)
        )
        campaign = read_campaign(write(tmp_path, "t,F,a\n" + rows, "level = 2.0", columns))
        assert any("harmonic 3" in str(item) for item in campaign.suspicions) == clips
        # 50 periods of pure cosines: exact but for the digits written.
        table = campaign.measurement
        assert table.value[table.harmonic == 1] == pytest.approx(np.exp(-0.3j), abs=1e-5)
