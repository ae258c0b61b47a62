"""Phases of drafted campaigns: the sign of time, what they count from, and sensors that read the other way round."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from study.campaign.new_campaign import draft_campaign, read_folder
from study.campaign.question import Assumptions
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv


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
    assert "decreases through the resonance in 2 of 3 curves and increases in 1" in told.assumed


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
    assert any("taken as relative to it" in item for item in campaign.draft.assumptions()) is phased
    assert ("taken as relative to it" in campaign.path.read_text()) is phased


def test_a_phase_of_no_column_is_reported(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    header = "freq [Hz],F [N],x [m],phi_x [deg],phi_ref [deg]"
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, np.abs(x), np.degrees(np.angle(x)), 30 * ONES)
    campaign, _ = drafted(tmp_path)
    assert any('phase "phi_ref [deg]" matches no column' in sentence for sentence in campaign.draft.left_out)


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


def test_an_acceleration_with_the_phase_of_a_displacement_is_suspected(tmp_path: Path) -> None:
    x = receptance(FREQUENCY) * (2 * np.pi * FREQUENCY) ** 2  # an acceleration is -omega^2 x
    header = "frequency [Hz],force [N],amplitude [m/s^2],phase [rad]"
    write_csv(tmp_path / "a.csv", header, FREQUENCY, ONES, np.abs(x), np.angle(x))
    campaign, manifest = drafted(tmp_path)
    # The sensor may be beyond a node: its readings stay as they are.
    assert "sign" not in manifest["run"][0]["columns"]["acceleration"]
    assert any("opposite to that of acceleration" in sentence for sentence in campaign.suspicions)


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
