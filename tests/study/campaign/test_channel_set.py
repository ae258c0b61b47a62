"""Sets of channels beside each other in one table are runs of their own; what belongs to no set is left out by name."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from study.campaign.new_campaign import draft_campaign, read_folder
from study.campaign.question import Assumptions
from tests.study.campaign.drafted_folder import FREQUENCY, drafted, receptance, write_csv

LEVELS = (1.0, 3.0, 10.0)
TIME = np.arange(2000) / 2000.0


def response(level: float, place: int = 1) -> Any:
    """Complex displacement of the sensor of a place, not proportional to the force [m]."""
    return level * receptance(FREQUENCY, 100.0 - level / 10) / place


def dataset(values: Any, unit: str, text: str = "", node: int = 12, abscissa: str = "frequency") -> Column:
    function = "time" if abscissa == "time" else "spectrum"
    return Column(
        name=f"{node}", values=values, unit=unit, abscissa=abscissa, function=function,
        response=Point(node=node, direction="+z"), facts={"line 1": text} if text else {},
    )  # fmt: skip


def write_datasets(path: Path, *columns: Column, abscissa: Column | None = None) -> None:
    first = abscissa or Column(name="frequency", values=FREQUENCY, unit="Hz")
    write_uff(MeasuredFile(path=path, format="", columns=(first, *columns)), path)


def check_levels(folder: Path, places: int = 1) -> None:
    """Whether each level has the responses of its own, by the order of sensors."""
    table = read_campaign(folder).measurement
    assert {*table.level.tolist()} == {*LEVELS}
    for level in LEVELS:
        for place in range(places):
            own = (table.level == level) & (table.sensor == place) & (table.harmonic == 1)
            np.testing.assert_allclose(table.value[own], response(level, place + 1), rtol=1e-4)


def datasets_by_set(told: Callable[[float], str]) -> list[Column]:
    return [
        one
        for level in LEVELS
        for one in (
            dataset(level + 0j * FREQUENCY, "N", told(level)), dataset(response(level), "m", told(level)),
            dataset(response(level, 2), "m", told(level), node=5),
        )
    ]  # fmt: skip


@pytest.mark.parametrize("told", [lambda level: f"Level {level:g} N", lambda _: ""], ids=["by text", "by order"])
def test_levels_in_one_universal_file_are_runs_with_their_own_force(tmp_path: Path, told: Any) -> None:
    write_datasets(tmp_path / "all.uff", *datasets_by_set(told))
    campaign, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor", "test")] == [3, 2, 1]
    assert not campaign.draft.left_out
    check_levels(tmp_path, places=2)


def test_datasets_that_are_sorted_by_channel_are_paired_by_their_number(tmp_path: Path) -> None:
    columns = datasets_by_set(lambda _: "")
    write_datasets(tmp_path / "all.uff", *columns[::3], *columns[1::3], *columns[2::3])
    drafted(tmp_path)
    check_levels(tmp_path, places=2)


def test_levels_without_a_force_are_those_of_the_texts(tmp_path: Path) -> None:
    write_datasets(tmp_path / "all.uff", *[dataset(response(level), "m", f"Sine {level:g} N") for level in LEVELS])
    drafted(tmp_path)
    check_levels(tmp_path)


def test_a_lost_dataset_is_paired_by_text_and_never_by_order(tmp_path: Path) -> None:
    columns = datasets_by_set(lambda level: f"{level:g} N")
    write_datasets(tmp_path / "all.uff", *columns[:4], *columns[5:])  # the first sensor at 3 N is missing
    drafted(tmp_path)
    table = read_campaign(tmp_path).measurement
    assert len(table.value) == 5 * len(FREQUENCY)
    np.testing.assert_allclose(table.value[(table.level == 3.0)], response(3.0, 2), rtol=1e-4)
    lost = tmp_path / "order"
    lost.mkdir()
    columns = datasets_by_set(lambda _: "")
    write_datasets(lost / "all.uff", *columns[:4], *columns[5:])
    draft_or_error = ""
    try:
        draft_or_error = " ".join(drafted(lost)[0].draft.left_out)
    except CampaignError as error:
        draft_or_error = str(error)
    assert "neither their texts nor their order" in draft_or_error


def test_dwells_in_one_universal_file_keep_their_own_force(tmp_path: Path) -> None:
    columns = []
    for level, frequency in ((1.0, 76.0), (1.0, 80.0), (3.0, 76.0)):
        wave = level * np.exp(2j * np.pi * frequency * TIME)
        columns += [dataset(wave.real, "N", abscissa="time"), dataset((2j * wave).real, "m/s^2", abscissa="time")]
    write_datasets(tmp_path / "dwells.uff", *columns, abscissa=Column(name="time", values=TIME, unit="s"))
    drafted(tmp_path)
    table = read_campaign(tmp_path).measurement
    first = table.harmonic == 1
    states = {*zip(table.level[first].tolist(), table.frequency[first].round(3).tolist(), strict=True)}
    assert states == {(1.0, 76.0), (1.0, 80.0), (3.0, 76.0)}
    np.testing.assert_allclose(table.value[first] / table.level[first], 2j, rtol=1e-3)


def polar(values: Any) -> tuple[Any, Any]:
    return 1e6 * np.abs(values), np.degrees(np.angle(values))


@pytest.mark.parametrize(
    ("header", "leading"),
    [
        ("f [Hz],A_1N [um],phi_1N [deg],A_3N [um],phi_3N [deg],A_10N [um],phi_10N [deg]", 0),
        (",".join(["f [Hz]", *["Force [N],Amp [um],Phase [deg]"] * 3]), 1),
        (",".join(f"f_{level:g}N [Hz],A_{level:g}N [um],phi_{level:g}N [deg]" for level in LEVELS), 2),
    ],
)
def test_levels_in_columns_of_their_own_are_runs(tmp_path: Path, header: str, leading: int) -> None:
    columns: list[Any] = [] if leading == 2 else [FREQUENCY]
    for level in LEVELS:
        columns += [[], [level + 0 * FREQUENCY], [FREQUENCY]][leading]
        columns += polar(response(level))
    write_csv(tmp_path / "levels.csv", header, *columns)
    campaign, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor", "test")] == [3, 1, 1]
    assert not campaign.draft.left_out
    check_levels(tmp_path)


@pytest.mark.parametrize(
    ("amplitude", "phase"),
    [
        ("Disp {} N [um]", "Phase {} N [deg]"), ("Weg {} N / µm", "Phase {} N / °"), ("Disp {} N,um", "Phase {} N,deg"),
        ("Amp [um] {}N", "Phase [deg] {}N"), ("Amp (um) {}N", "Phase (deg) {}N"),
        ("Amplitude ({} N) [um]", "Phase ({} N) [deg]"), ("Amplitude [um] ({} N)", "Phase [deg] ({} N)"),
        ("Amp,um @ {}N", "Phase,deg @ {}N"),
    ],
)  # fmt: skip
def test_a_level_stands_anywhere_in_a_name_but_in_its_unit(tmp_path: Path, amplitude: str, phase: str) -> None:
    labels = [label.format(f"{level:g}") for level in LEVELS for label in (amplitude, phase)]
    rows = ["f,Hz", *labels] if "," in amplitude else ["f [Hz]", *labels]
    header = "\n".join(",".join(cells) for cells in zip(*(row.split(",") for row in rows), strict=True))
    columns = [part for level in LEVELS for part in polar(response(level))]
    write_csv(tmp_path / "levels.csv", header, FREQUENCY, *columns)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [3, 1]
    check_levels(tmp_path)


def test_a_force_above_a_row_of_units_is_of_the_level_in_its_name(tmp_path: Path) -> None:
    columns = [part for level in LEVELS for part in (level + 0 * FREQUENCY, *polar(response(level)))]
    names = ",".join(f"Force {level:g} N,Disp {level:g} N,Phase {level:g} N" for level in LEVELS)
    write_csv(tmp_path / "a.csv", f"f,{names}\nHz{',N,um,deg' * 3}", FREQUENCY, *columns)
    campaign, manifest = drafted(tmp_path)
    assert all("force" in run["columns"] for run in manifest["run"])
    assert not campaign.draft.left_out
    check_levels(tmp_path)


def test_a_preload_in_the_name_of_a_column_is_no_level(tmp_path: Path) -> None:
    columns = [part for level in LEVELS for part in polar(response(level))]
    header = ",".join(f"tip preload 20N {level:g}N [um],phase preload 20N {level:g}N [deg]" for level in LEVELS)
    write_csv(tmp_path / "a.csv", f"f [Hz],{header}", FREQUENCY, *columns)
    drafted(tmp_path)
    check_levels(tmp_path)


def test_quantities_tell_tests_within_each_level(tmp_path: Path) -> None:
    sets = [(speed, level) for speed in (1000, 2000) for level in LEVELS]
    header = ",".join(f"Force {speed}rpm {level:g}N [N],Disp {speed}rpm {level:g}N [um]" for speed, level in sets)
    columns = [part for _, level in sets for part in (level + 0 * FREQUENCY, polar(response(level))[0])]
    write_csv(tmp_path / "tip.csv", f"f [Hz],{header}", FREQUENCY, *columns)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [6, 1]
    assert {test["name"] for test in manifest["test"]} == {"1000rpm", "2000rpm"}


def test_a_number_before_the_unit_of_a_name_is_no_level(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", "f [Hz],Force 1 N,tip dB re 1 um", FREQUENCY, 0 * FREQUENCY + 3, FREQUENCY)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [1, 1]
    assert {*read_campaign(tmp_path).measurement.level.tolist()} == {3.0}


def test_what_may_be_of_any_level_is_left_out_by_name(tmp_path: Path) -> None:
    columns = [part for level in LEVELS for part in polar(response(level))]
    header = "f [Hz],F [N],root [um],A_1N [um],phi_1N [deg],A_3N [um],phi_3N [deg],A_10N [um],phi_10N [deg]"
    write_csv(tmp_path / "levels.csv", header, FREQUENCY, 1 + 0 * FREQUENCY, np.abs(response(1.0)), *columns)
    campaign, _ = drafted(tmp_path)
    check_levels(tmp_path)
    assert [name in " ".join(campaign.draft.left_out) for name in ('"F [N]"', '"root [um]"')] == [True, True]


@pytest.mark.parametrize(("words", "key"), [(("run1", "run2"), "repeat"), (("up", "down"), "sweep")])
def test_repeats_and_directions_in_columns_share_the_force(tmp_path: Path, words: tuple[str, str], key: str) -> None:
    columns = [part for _ in words for part in polar(response(3.0))]
    header = ",".join(["f [Hz],Force [N]", *[f"tip {word} [um],phase {word} [deg]" for word in words]])
    write_csv(tmp_path / "sine_3N.csv", header, FREQUENCY, 3 + 0 * FREQUENCY, *columns)
    _, manifest = drafted(tmp_path)
    assert len(manifest["sensor"]) == 1
    assert [run[key] for run in manifest["run"]] == ([1, 2] if key == "repeat" else ["up", "down"])


def test_channels_in_volts_are_sensors_and_no_levels(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", "f [Hz],F [N],acc_1_V,acc_2_V", FREQUENCY, *[np.abs(response(1.0))] * 3)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [1, 2]


@pytest.mark.parametrize("layout", ["force and response", "vector of levels", "sensors by levels", "hdf5"])
def test_the_axis_of_levels_of_an_array_is_no_sensor(tmp_path: Path, layout: str) -> None:
    one = np.stack([response(level) for level in LEVELS], axis=-1)
    both = np.stack([one, one / 2], axis=1)
    forces = np.stack([level + 0 * FREQUENCY for level in LEVELS], axis=-1)
    if layout == "hdf5":
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["frequency"], file["level_N"] = FREQUENCY, np.array(LEVELS)
            file["disp_m"] = np.moveaxis(both, 2, 0)
    else:
        values = {"f_Hz": FREQUENCY, "x_m": both if layout == "sensors by levels" else one}
        levels = {"level_N": np.array(LEVELS)} if layout == "vector of levels" else {"force_N": forces}
        savemat(tmp_path / "a.mat", {**values, **levels})
    _, manifest = drafted(tmp_path)
    places = 2 if layout in {"sensors by levels", "hdf5"} else 1
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [3, places]
    check_levels(tmp_path, places)


def test_an_array_of_two_short_axes_without_levels_is_left_out(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"f_Hz": FREQUENCY, "x_m": np.ones((41, 2, 3)), "acc_mm_s2": np.ones(41)})
    measured = read_folder(tmp_path)
    draft = draft_campaign(measured, Assumptions())
    assert any('"x_m" (2 x 3 series)' in sentence for sentence in draft.left_out)
    assert len(draft.entries["sensor"]) == 1


@pytest.mark.parametrize("of_force", [None, 1])
def test_levels_and_harmonics_in_different_lines_of_one_universal_file_are_combined(
    tmp_path: Path, of_force: int | None
) -> None:
    columns = []
    for level in LEVELS:
        told = {"line 1": f"Level {level:g} N"}
        force = dataset(level + 0j * FREQUENCY, "N")
        columns.append(replace(force, facts=told | ({"line 2": f"Order {of_force}.00"} if of_force else {})))
        columns += [
            replace(dataset(response(level) / number, "m"), facts=told | {"line 2": f"Order {number}.00"})
            for number in (1, 3)
        ]
    write_datasets(tmp_path / "sine.uff", *columns)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [6, 1]
    check_levels(tmp_path)


def test_levels_and_repeats_in_different_lines_of_one_universal_file_are_combined(tmp_path: Path) -> None:
    columns = []
    for level in LEVELS:
        for repeat in (1, 2):
            told = {"line 1": f"Level {level:g} N", "line 2": f"repeat {repeat}"}
            columns.append(replace(dataset(level + 0j * FREQUENCY, "N"), facts=told))
            columns.append(replace(dataset(response(level), "m"), facts=told))
    write_datasets(tmp_path / "sine.uff", *columns)
    _, manifest = drafted(tmp_path)
    assert sorted((run["level"], run["repeat"]) for run in manifest["run"]) == [
        (level, repeat) for level in LEVELS for repeat in (1, 2)
    ]


def test_points_that_are_numbered_as_harmonics_are_sensors(tmp_path: Path) -> None:
    columns = [dataset(response(1.0), "m", f"Point H{node}", node=node) for node in (1, 2)]
    write_datasets(tmp_path / "sine.uff", dataset(1 + 0j * FREQUENCY, "N"), *columns)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [1, 2]


@pytest.mark.parametrize("layout", ["columns", "rows", "universal file"])
def test_harmonics_are_those_of_one_sensor(tmp_path: Path, layout: str) -> None:
    first, third, force = response(3.0), 0.03 * response(3.0), 3 + 0 * FREQUENCY
    if layout == "columns":
        header = "f [Hz],Force [N],tip H1 [um],tip H1 phase [deg],tip H3 [um],tip H3 phase [deg]"
        write_csv(tmp_path / "sine_3N.csv", header, FREQUENCY, force, *polar(first), *polar(third))
    elif layout == "rows":
        columns = np.concatenate([[FREQUENCY, force, 1 + 0 * force, *polar(first)],
                                  [FREQUENCY, force, 3 + 0 * force, *polar(third)]], axis=1)  # fmt: skip
        write_csv(tmp_path / "sine.csv", "f [Hz],Force [N],harmonic,tip [um],tip phase [deg]", *columns)
    else:
        datasets = [dataset(values, "m", f"Harmonic {n}") for n, values in ((1, first), (3, third))]
        write_datasets(tmp_path / "sine.uff", dataset(force + 0j, "N"), *datasets)
    _, manifest = drafted(tmp_path)
    assert len(manifest["sensor"]) == 1
    table = read_campaign(tmp_path).measurement
    for number, values in ((1, first), (3, third)):
        own = (table.harmonic == number) & (table.repeat == 1)
        np.testing.assert_allclose(table.value[own], values, rtol=1e-4)


def test_harmonics_of_several_levels_stand_beside_each_other(tmp_path: Path) -> None:
    sets = [(level, number) for level in LEVELS for number in (1, 3)]
    header = ",".join(f"tip {level:g}N H{number} [um],phase {level:g}N H{number} [deg]" for level, number in sets)
    columns = [part for level, number in sets for part in polar(response(level) / number)]
    write_csv(tmp_path / "tip.csv", f"f [Hz],{header}", FREQUENCY, *columns)
    drafted(tmp_path)
    check_levels(tmp_path)
    table = read_campaign(tmp_path).measurement
    third = (table.harmonic == 3) & (table.level == 10.0)
    np.testing.assert_allclose(table.value[third], response(10.0) / 3, rtol=1e-4)


def test_loops_side_by_side_have_a_force_each(tmp_path: Path) -> None:
    time = np.arange(4000) / 1000.0
    columns = [time]
    for size in (5.0, 20.0):
        moved = size * np.sin(2 * np.pi * time)
        columns += [moved, np.clip(2 * moved, -15.0, 15.0) + np.cos(2 * np.pi * time)]
    header = "time [s],displacement 5um [um],force 5um [N],displacement 20um [um],force 20um [N]"
    write_csv(tmp_path / "loops.csv", header, *columns)
    _, manifest = drafted(tmp_path)
    assert [loop["columns"]["force"] for loop in manifest["loop"]] == ["force 5um [N]", "force 20um [N]"]


def frequency_response(values: Any, text: str) -> Column:
    point = Point(node=12, direction="+z")
    return Column(
        name="12", values=values, unit="m/N", abscissa="frequency", function="frequency response", response=point,
        reference=point, facts={"line 1": text},
    )  # fmt: skip


def test_frequency_responses_at_levels_are_no_repeats(tmp_path: Path) -> None:
    write_datasets(
        tmp_path / "frf.uff", *[frequency_response(response(one) / one, f"stepped sine {one:g} N") for one in LEVELS]
    )
    _, manifest = drafted(tmp_path)
    assert not any("repeat" in entry for entry in manifest["frf"])
    assert len(manifest["frf"]) == 3


def test_of_two_estimates_of_a_frequency_response_the_first_is_used(tmp_path: Path) -> None:
    columns = [frequency_response(response(1.0) * size, name) for name, size in (("FRF H1", 1.0), ("FRF H2", 1.1))]
    write_datasets(tmp_path / "frf.uff", *columns)
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["frf"]) == 1
    np.testing.assert_allclose(read_campaign(tmp_path).data[0].value[0], response(1.0), rtol=1e-4)
    assert any("H2" in sentence for sentence in campaign.draft.left_out)


def test_the_second_input_of_an_array_of_responses_is_left_out(tmp_path: Path) -> None:
    values = np.stack([np.stack([response(1.0), 0.4 * response(1.0)])] * 2)
    savemat(tmp_path / "frf.mat", {"H": values, "f": FREQUENCY})
    campaign, manifest = drafted(tmp_path)
    (entry,) = manifest["frf"]
    assert [one for one in entry["columns"] if one != "frequency"] == ["h 1", "h 2"]
    assert any("input 2" in sentence for sentence in campaign.draft.left_out)


def test_files_of_a_sine_at_levels_say_the_level_of_their_responses(tmp_path: Path) -> None:
    for level in LEVELS:
        values = response(level) / level
        for kind in ("steppedsine", "frf"):
            write_csv(
                tmp_path / f"{kind}_{level:g}N.csv", "f [Hz],Re [m/N],Im [m/N]", FREQUENCY, values.real, values.imag
            )
    campaign, manifest = drafted(tmp_path)
    levels = {entry["file"]: entry.get("level") for entry in manifest["frf"]}
    assert levels == {f"steppedsine_{one:g}N.csv": one for one in LEVELS} | {
        f"frf_{one:g}N.csv": None for one in LEVELS
    }
    assert sum("responses at a level of" in sentence for sentence in campaign.suspicions) == 3


def test_each_response_has_the_frequencies_before_it(tmp_path: Path) -> None:
    other = FREQUENCY + 0.25
    columns = [FREQUENCY, np.abs(response(1.0)), other, np.abs(receptance(other))]
    write_csv(tmp_path / "a.csv", "f [Hz],tip [m],f [Hz],root [m]", *columns)
    _, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 1
    table = read_campaign(tmp_path).measurement
    for sensor, place in enumerate((0, 2)):
        np.testing.assert_allclose(table.frequency[table.sensor == sensor], columns[place])
        np.testing.assert_allclose(table.value[table.sensor == sensor].real, columns[place + 1])


@pytest.mark.parametrize(
    "names", [("acc 100mm", "acc 200mm"), ("acc 100mV/g", "acc 10mV/g"), ("acc 45deg", "acc 90deg")]
)
def test_places_and_sensitivities_in_names_are_no_levels(tmp_path: Path, names: tuple[str, str]) -> None:
    header = f"f [Hz],F [N],{names[0]} [m/s^2],{names[1]} [m/s^2]"
    write_csv(tmp_path / "a.csv", header, FREQUENCY, 1 + 0 * FREQUENCY, *[np.abs(response(1.0))] * 2)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [1, 2]


def test_a_set_frequency_beside_the_measured_one_is_no_set(tmp_path: Path) -> None:
    columns = [FREQUENCY, FREQUENCY + 0.001, 1 + 0 * FREQUENCY, *polar(response(1.0))]
    write_csv(tmp_path / "a.csv", "f set [Hz],f [Hz],F [N],tip [um],phase [deg]", *columns)
    _, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 1


def test_levels_over_frequencies_of_their_own_are_runs_of_one_test(tmp_path: Path) -> None:
    columns: list[Column] = []
    for number, level in enumerate(LEVELS):
        rows = slice(number, None)
        abscissa = Column(name=f"frequency {number}", values=FREQUENCY[rows], unit="Hz", function="frequency")
        columns += [abscissa, replace(dataset(response(level)[rows], "m", f"{level:g} N"), abscissa=abscissa.name)]
    write_uff(MeasuredFile(path=tmp_path / "a.uff", format="", columns=tuple(columns)), tmp_path / "a.uff")
    _, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 1
    assert [run["level"] for run in manifest["run"]] == [*LEVELS]


def test_a_second_column_of_one_sensor_is_left_out_by_name(tmp_path: Path) -> None:
    size = np.abs(response(1.0))
    columns = [np.tile(FREQUENCY, 2), 1 + 0 * np.tile(FREQUENCY, 2), ["tip"] * 41 + ["root"] * 41]
    write_csv(tmp_path / "a.csv", "f [Hz],F [N],sensor,x1 [m],x2 [m]", *columns, *[np.tile(size, 2)] * 2)
    campaign, manifest = drafted(tmp_path)
    assert [entry["name"] for entry in manifest["sensor"]] == ["tip", "root"]
    assert any('"x2 [m]"' in sentence for sentence in campaign.draft.left_out)


def test_columns_below_the_merged_cell_of_a_level_are_of_it_and_others_are_left_out(tmp_path: Path) -> None:
    columns = [part for level in LEVELS[:2] for part in polar(response(level))]
    other = np.abs(response(2.0))
    header = "f [Hz],1 N Amp [um],Phase [deg],3 N Amp [um],Phase [deg],root [m],root [m]"
    write_csv(tmp_path / "a.csv", header, FREQUENCY, *columns, other, other)
    campaign, manifest = drafted(tmp_path)
    assert [run["columns"]["displacement"]["phase"] for run in manifest["run"]] == ["Phase [deg]", "Phase [deg] (2)"]
    assert sum('"root [m]' in sentence for sentence in campaign.draft.left_out) == 2


def test_a_block_below_the_merged_cell_of_a_level_may_begin_with_its_force(tmp_path: Path) -> None:
    columns = [part for level in LEVELS for part in (level + 0 * FREQUENCY, *polar(response(level)))]
    above = ",".join(["Level", *(f"{level:g} N,," for level in LEVELS)])
    header = ",".join(["f [Hz]", *["F [N],Amp [um],Phase [deg]"] * 3])
    write_csv(tmp_path / "a.csv", f"{above}\n{header}", FREQUENCY, *columns)
    _, manifest = drafted(tmp_path)
    assert [len(manifest[kind]) for kind in ("run", "sensor")] == [3, 1]
    check_levels(tmp_path)
