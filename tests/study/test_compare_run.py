"""`stickslip compare` as a user runs it: a perfect model is noise, a spoilt sensor is named, mistakes are flagged."""

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, Drive, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.metric.misfit import find_worst, find_worst_cell, split_misfit, summarise_misfit
from correlation.model import Sensor
from correlation.prediction import Points, Predictor
from study import cli
from study.case.setup import Setup, read_case
from study.compare.report import format_report
from study.compare.run import compare
from study.compare.suspicions import find_all_suspicions
from study.shipped_cases import BEAM
from transient.virtual_bench.campaign import CampaignPoints
from transient.virtual_bench.hidden_effect import make_campaign

LEVELS, REPEATS, NOISE = (1.0, 3.0), 5, 0.005
JOINTED = 472.0 * np.array([0.98, 0.99, 0.995, 0.998, 1.0, 1.002, 1.005, 1.01, 1.02])
FREE = 91.72 * np.array([0.97, 0.985, 0.993, 1.0, 1.007, 1.015, 1.03])
#: Sensor, and whether it is a contact force.
CHANNELS = {"tip": False, "mid": False, "left_T": True}


@cache
def measured_from_the_model(gain: float = 1.0) -> Campaign:
    """The shipped beam's own response with noise; the sensor "mid" reads `gain` times what it should."""
    model = setup().model.with_sensor("mid", gain=gain)
    keys = [
        (test, level, frequency, number, harmonic)
        for test, frequencies in enumerate((JOINTED, FREE))
        for level in LEVELS
        for frequency in frequencies
        for number, force in enumerate(CHANNELS.values())
        for harmonic in ((0, 1) if force else (1, 3))
        if not (force and test)
    ]
    test, level, frequency, sensor, harmonic = (np.array(column) for column in zip(*keys, strict=True))
    names = np.array([*CHANNELS])[sensor]
    points = Points(free=test == 1, level=level, frequency=frequency, sensor=names, harmonic=harmonic)
    exact = Predictor(points=points).predict(model).value
    random = np.random.default_rng(3)
    k, count = len(keys), REPEATS * len(keys)
    noise = random.standard_normal((REPEATS, k)) + 1j * random.standard_normal((REPEATS, k))
    floor = np.where(np.isin(names, ["tip", "mid"]), 1e-9, 0.02)
    value = exact + NOISE * np.where(harmonic > 0, np.abs(exact), 0.0) * noise + floor * np.roll(noise, 1, axis=1)
    value = np.where(harmonic > 0, value, value.real)
    repeat = np.repeat(np.arange(1, REPEATS + 1), k)
    columns = {"test": test, "level": level, "frequency": frequency, "sensor": sensor, "harmonic": harmonic}
    table = Measurement(
        **{name: np.tile(column, REPEATS) for name, column in columns.items()},
        order=np.arange(1, count + 1),
        repeat=repeat,
        sweep=np.ones(count, dtype=int),
        value=value.ravel(),
    )
    sensors = [
        MeasuredSensor(name=name, quantity="contact force", line="left", component="tangential")
        if force
        else MeasuredSensor(name=name, quantity="displacement", direction="z", place=name)
        for name, force in CHANNELS.items()
    ]
    return Campaign(
        title="The model itself",
        folder=Path(),
        sensors=tuple(sensors),
        tests=(Test(name="stepped"), Test(name="free", configuration="free")),
        measurement=table,
        held_out=HeldOut(repeats=(4, 5)),
    )


@cache
def setup() -> Setup:
    return read_case(BEAM).setup


def test_a_perfect_model_is_noise() -> None:
    result = compare(setup(), measured_from_the_model())
    assert result.held_out is not None
    for side in (result.train, result.held_out):
        # Noise is told from few repeats and numerical error is allowed for: the mean is 1 within a third, not exactly.
        assert 0.5 < summarise_misfit(side).deviations < 1.33
        assert 0.5 < summarise_misfit(side).whitened < 1.33
        assert np.isfinite(side.predicted).all()
    assert len(result.peaks) == 4
    for peak in result.peaks:
        # Five standard deviations, of a scatter that is itself told from five repeats.
        assert abs(peak.frequency_error) * peak.frequency < 5 * peak.frequency_deviation
    assert not result.suspicions


def test_a_sensor_that_reads_too_much_is_named() -> None:
    result = compare(setup(), measured_from_the_model(1.1))
    assert find_worst(split_misfit(result.train, "sensor")).label == "mid"
    cell, points = find_worst_cell(result.train)
    assert set(points.sensor) == {"mid"}
    # 1 / 1.1 - 1, within noise of 0.5 % in the mean of three repeats and a few frequencies.
    assert cell.signed_amplitude_error == pytest.approx(1 / 1.1 - 1, abs=0.006)
    assert cell.signed_phase_error == pytest.approx(0, abs=0.006)
    rows = result.train.where((result.train.points.sensor == "tip") & (result.train.points.harmonic == 1))
    assert summarise_misfit(rows).deviations < 2


def test_table_document_and_figures_say_the_same(at_home: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    points = CampaignPoints(
        levels=(3.0, 5.0), frequencies=tuple(JOINTED[::2].tolist()), free_frequencies=tuple(FREE.tolist()), n_repeat=3
    )
    make_campaign(at_home / "bench", seed=2, kind="mass", strength=2e-3, points=points)
    assert cli.main(["compare", str(BEAM), "bench", "--out", "out", "--json"]) == 0
    document = json.loads(capfdbinary.readouterr().out)
    with (at_home / "out" / "beam_compare.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for name, part in document["sets"].items():
        of = [row for row in rows if row["set"] == name]
        numbers = [float(row[f"whitened_{what}"]) for row in of for what in ("real", "imag") if row[f"whitened_{what}"]]
        assert len(numbers) == part["n_number"]
        # Seven digits are written.
        assert np.sqrt(np.mean(np.square(numbers))) == pytest.approx(part["whitened"], rel=1e-5)
    assert {(row["level_N"], row["level_unit"]) for row in rows if row["set"] == "training"} == {("3", "N")}
    # Two grams at the tip: the real beam is slower than its model, at every level of the free structure.
    free = [item for item in document["resonances"] if item["configuration"] == "free"]
    assert [item["level_n"] for item in free] == [3.0, 5.0]
    assert all(item["frequency_error"] > 0.003 for item in free)
    pictures = [Path(file) for file in document["files"] if file.endswith(".png")]
    assert {file.stem for file in pictures} >= {
        "beam_compare_map_jointed",
        "beam_compare_map_free",
        "beam_compare_frf_free",
    }
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in pictures)


def test_the_answer_is_in_words() -> None:
    words = format_report(compare(setup(), measured_from_the_model(1.1)))
    assert "worst sensor         mid" in words
    assert "the model's amplitude is 9" in words
    assert "% too small" in words
    assert "Resonances, and the error of the model" in words


def test_calibrating_a_perfect_model_changes_nothing() -> None:
    result = compare(setup(), measured_from_the_model(), calibrate=True)
    assert {item.name for item in result.calibrated} == {"kt", "kn", "mu", "zeta", "E", "bearing"}
    for item in result.calibrated:
        # The start is the truth, the end its estimate: five of the standard deviations that it gives itself.
        assert abs(item.factor - 1) < 5 * item.deviation
        assert item.deviation < 0.1
    assert "Calibrated on the training data: kt x " in format_report(result)


def renamed(sensors: Sequence[MeasuredSensor], which: str, **changes: object) -> tuple[MeasuredSensor, ...]:
    return tuple(replace(item, **changes) if item.name == which else item for item in sensors)  # type: ignore[arg-type]


def test_swapped_cables_and_angular_frequencies_are_flagged() -> None:
    campaign = measured_from_the_model()
    swap = np.array([1, 0, 2])
    table = replace(campaign.measurement, sensor=swap[campaign.measurement.sensor])
    result = compare(setup(), replace(campaign, measurement=table))
    assert 'sensors "tip" and "mid" look swapped' in [item.where for item in result.suspicions]
    table = replace(campaign.measurement, frequency=2 * np.pi * campaign.measurement.frequency)
    result = compare(setup(), replace(campaign, measurement=table))
    (suspicion,) = [item for item in result.suspicions if "rad/s" in item.sentence]
    assert "2 pi times the model's resonance" in suspicion.sentence


def test_millimetres_in_one_test_are_flagged() -> None:
    campaign = measured_from_the_model()
    table = campaign.measurement
    value = np.where((table.test == 1) & (table.sensor == 1), 1e3, 1.0) * table.value
    spoilt = replace(campaign, measurement=replace(table, value=value))
    (result,) = find_all_suspicions(spoilt, setup().model)
    assert result.where == 'test "free", sensor "mid"'
    # Three digits, of the median of noise of half a per cent.
    one = r"(0\.99\d|1|1\.01) times"
    evidence = rf"the other sensors of the same runs {one}, and itself {one} in test \"stepped\""
    assert re.search(rf"it reads 1,000 times what the model says, {evidence}: are its values in mm", result.sentence)


@pytest.mark.parametrize(("factor", "is_unit"), [(1e-3, True), (1e3, True), (0.1, False), (1.0, False)])
def test_a_contact_stiffness_in_another_unit_is_flagged(factor: float, is_unit: bool) -> None:
    model = setup().model
    names = [joint.name for joint in model.system.joints if joint.name in model.lines["left"]]
    values = {name: {"tangential_stiffness": factor * model.contact(name).tangential_stiffness} for name in names}
    result = [
        item
        for item in find_all_suspicions(measured_from_the_model(), model.with_joints(values))
        if "check its unit" in item.sentence
    ]
    assert [(item.where, f"tangential_stiffness {1 / factor:g} times" in item.sentence) for item in result] == (
        [('line "left"', True)] if is_unit else []
    )


@pytest.mark.parametrize("unknown", ["drive", "sensors"])
def test_readings_of_unknown_size_tell_nothing_of_a_stiffness(unknown: str) -> None:
    model, campaign = setup().model, measured_from_the_model()
    names = [joint.name for joint in model.system.joints if joint.name in model.lines["left"]]
    values = {name: {"tangential_stiffness": 1e-3 * model.contact(name).tangential_stiffness} for name in names}
    if unknown == "drive":
        campaign = replace(campaign, drive=Drive(unit="V", calibrated=False))
    else:
        campaign = replace(campaign, sensors=tuple(replace(item, calibrated=False) for item in campaign.sensors))
    assert "check its unit" not in str(find_all_suspicions(campaign, model.with_joints(values)))


def test_a_sensor_is_placed_by_its_coordinates() -> None:
    campaign = measured_from_the_model()
    at = np.array([0.30, 0.0, 0.0])
    sensors = renamed(campaign.sensors, "tip", name="laser", place=None, coordinates=at)
    measured = replace(campaign, sensors=sensors)
    result = compare(setup(), measured)
    assert summarise_misfit(result.train).deviations < 1.33
    # The case that tells the numerical error does not know it, and need not.
    assert "laser" in [item.name for item in read_case(BEAM, measured).setup.model.sensors]
    assert "laser" in result.train.points.sensor


def test_what_a_finer_model_changes_counts_as_numerical_error(at_home: Path) -> None:
    for file in BEAM.parent.iterdir():
        (at_home / file.name).write_bytes(file.read_bytes())
    text = (at_home / "beam.toml").read_text(encoding="utf-8")
    # A finer model that is 4 % off is a large numerical error: sensors that read 10 % too much are less of a wonder.
    finer = text[: text.index("[numerical_error]")].replace("[[load]]", '[[load]]\namplitude = "1.04 N"')
    (at_home / "finer.toml").write_text(finer, encoding="utf-8")
    spread = text.replace('refined = ["beam_finer.toml"]', 'refined = ["finer.toml"]')
    (at_home / "case.toml").write_text(spread, encoding="utf-8")
    campaign = measured_from_the_model(1.1)
    campaign = replace(campaign, sensors=renamed(campaign.sensors, "mid", name="other"))
    loose, strict = (compare(read_case(case).setup, campaign).train for case in ("case.toml", "beam.toml"))
    assert summarise_misfit(loose).deviations < 0.5 * summarise_misfit(strict).deviations


MISTAKES = {
    "far": ({"name": "x", "place": None, "coordinates": np.array([0.35, 0, 0])}, "is 0.05 m from the nearest node"),
    "no place": (
        {"name": "x", "place": "root"},
        'sits at place "root", which the model does not have; its places: tip',
    ),
    "quantity": ({"quantity": "velocity"}, "measures velocity, the model's sensor of that name displacement"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_sensor_that_does_not_fit_is_refused(at_home: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    changes, expected = MISTAKES[name]
    campaign = measured_from_the_model()
    write_campaign(replace(campaign, sensors=renamed(campaign.sensors, "tip", **changes)), at_home / "campaign")
    assert cli.main(["compare", str(BEAM), "campaign"]) == 2
    message = capfd.readouterr().err
    assert expected in message
    assert "Traceback" not in message


def test_a_harmonic_that_the_model_does_not_keep_is_refused(at_home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    campaign = measured_from_the_model()
    harmonic = np.where(campaign.measurement.harmonic == 3, 9, campaign.measurement.harmonic)
    write_campaign(
        replace(campaign, measurement=replace(campaign.measurement, harmonic=harmonic)), at_home / "campaign"
    )
    assert cli.main(["compare", str(BEAM), "campaign"]) == 2
    assert (
        "the campaign has harmonic 9, the model keeps 7: raise harmonics.highest in the case" in capfd.readouterr().err
    )


def test_no_campaign_and_no_case(at_home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["compare", str(BEAM), "nowhere"]) == 2
    assert "nowhere" in capfd.readouterr().err
    assert cli.main(["compare", "nothing.toml", "nowhere"]) == 2
    assert "there is no such case file" in capfd.readouterr().err


def test_the_shipped_sensors_are_those_of_the_bench() -> None:
    names = [item.name for item in setup().model.sensors if isinstance(item, Sensor)]
    assert names == ["tip", "slot", "excitation", "mid"]
