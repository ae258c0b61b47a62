"""The page of a comparison: it holds everything, loads nothing, and shows residuals that are those of the misfit."""

import html
import json
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Suspicion, Test
from correlation.data_type.registry import Features
from correlation.metric.misfit import summarise_misfit
from correlation.metric.peak_error import PeakError
from correlation.model import Sensor
from correlation.prediction import Points, Predictor
from correlation.row_table import join_tables
from study.case.setup import read_case
from study.compare.backbone import draw_backbones
from study.compare.curve import Drawing
from study.compare.data import DataComparison
from study.compare.page import make_page
from study.compare.report import format_report
from study.compare.result import Calibrated, ComparisonResult
from study.compare.run import compare
from study.compare.section.linearity import make_linearity_sections
from study.compare.section.overview import describe_left_out
from study.compare.section.response import make_response_sections
from study.compare.section.section import Section
from study.compare.sentence import describe_resonances, summarise
from study.page.table import Table
from study.shipped_cases import BEAM

LEVELS, N_REPEAT, NOISE = (1.0, 3.0), 4, 0.005
FREQUENCY = 472.0 * np.array([0.98, 0.99, 0.995, 0.998, 1.0, 1.002, 1.005, 1.01, 1.02])
SENSORS = ("tip", "mid", "left_N")


class References(HTMLParser):
    """What the elements of a page refer to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        del tag
        self.found += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data", "action"}]


@cache
def compared(gain: float = 1.0) -> ComparisonResult:
    """The shipped beam beside its own response with noise; the sensor "mid" reads `gain` times what it should."""
    setup = read_case(BEAM).setup
    model = setup.model.with_sensor("mid", gain=gain)
    keys = [(level, frequency, number) for level in LEVELS for frequency in FREQUENCY for number in range(len(SENSORS))]
    level, frequency, sensor = (np.array(column) for column in zip(*keys, strict=True))
    k, one = len(keys), np.ones(len(keys), dtype=np.int64)
    points = Points(free=one == 0, level=level, frequency=frequency, sensor=np.array(SENSORS)[sensor], harmonic=one)
    exact, random = Predictor(points=points).predict(model).value, np.random.default_rng(5)
    noise = random.standard_normal((N_REPEAT, k)) + 1j * random.standard_normal((N_REPEAT, k))
    repeats = np.repeat(np.arange(1, N_REPEAT + 1), k)
    table = Measurement(
        test=np.zeros(N_REPEAT * k), order=np.arange(N_REPEAT * k), repeat=repeats, sweep=np.ones(N_REPEAT * k),
        level=np.tile(level, N_REPEAT), frequency=np.tile(frequency, N_REPEAT), sensor=np.tile(sensor, N_REPEAT),
        harmonic=np.tile(one, N_REPEAT), value=(exact * (1 + NOISE * noise)).ravel(),
    )  # fmt: skip
    sensors = [
        MeasuredSensor(name=name, quantity="displacement", direction="z", place=name)
        if isinstance(next(item for item in model.sensors if item.name == name), Sensor)
        else MeasuredSensor(name=name, quantity="contact force", line="left", component="normal")
        for name in SENSORS
    ]
    campaign = Campaign(
        title="The <model> itself", folder=BEAM.parent, sensors=tuple(sensors), tests=(Test(name="stepped"),),
        measurement=table, held_out=HeldOut(),
    )  # fmt: skip
    return compare(setup, campaign)


@cache
def drawing(gain: float = 1.0) -> Drawing:
    return Drawing.of(compared(gain))


def data_of(text: str) -> dict[str, Any]:
    result = re.search(r"<script>const DATA = (.*);</script>", text)
    assert result is not None
    parsed: dict[str, Any] = json.loads(result[1].replace("<\\/script", "</script"))
    return parsed


def test_the_page_holds_everything_and_loads_nothing() -> None:
    text = make_page(compared(), drawing())
    references = References()
    references.feed(text)
    assert {item for item in references.found if not item.startswith("#")} == {"data:,"}
    assert "default-src 'none'" in html.unescape(text)
    assert len(re.findall(r"plotly\.js v", text)) == 1
    # Names of the user are no HTML.
    assert "The &lt;model&gt; itself" in text
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert titles == [
        "Measured and predicted responses", "Where the model fails", "Resonances and backbone",
        "Linearity over levels", "Contact forces", "What was compared",
    ]  # fmt: skip
    # plotly.js is 4.7 MB; a few hundred readings are nothing beside it.
    assert len(text) < 5.5e6


def test_residuals_are_those_of_the_misfit_and_lines_meet_the_predicted_points() -> None:
    section = data_of(make_page(compared(), drawing()))["sections"][0]
    assert section["element"] == "responses"
    misfit = compared().train
    for panel in section["data"]["panels"]:
        sensor = panel["label"].split(",")[0]
        for group in panel["groups"]:
            level = LEVELS[group["level"]]
            rows = (misfit.points.sensor == sensor) & (misfit.points.level == level)
            rows &= misfit.points.harmonic == panel["harmonic"]
            order = np.argsort(misfit.points.frequency[rows])
            # Four digits are written.
            np.testing.assert_allclose(
                group["residual"]["real"], -misfit.standardised[rows][order, 0], rtol=1e-3, atol=1e-9
            )
            assert len(group["runs"]) == N_REPEAT
            assert set(np.round(group["frequency"], 5)) <= set(np.round(group["line_frequency"], 5))
            at = np.searchsorted(group["line_frequency"], group["frequency"])
            predicted = np.array(group["amplitude"]) * (1 + np.array(group["residual"]["amplitude"]) / 100)
            # Lines begin at rest at each point, the prediction at what the sweep left; and four digits.
            np.testing.assert_allclose(np.array(group["line"]["amplitude"])[at], predicted, rtol=2e-2)


def test_each_row_of_the_map_has_the_name_of_its_level() -> None:
    section = data_of(make_page(compared(), drawing()))["sections"][1]
    assert section["element"] == "map"
    (shown,) = section["data"]["maps"]
    for group in shown["groups"]:
        places = shown["places"][group["first"] : group["last"] + 1]
        assert group["levels"] == [f"{place['level']:g} N" for place in places]


def test_noise_of_one_repeat_is_no_nonlinearity() -> None:
    """Both levels have the response of the lower one, each with noise of its own."""
    campaign = compared().campaign
    table = campaign.measurement
    one, other = (table.where((table.repeat == repeat) & (table.level == LEVELS[0])) for repeat in (1, 2))
    ratio = LEVELS[1] / LEVELS[0]
    twice = replace(other, level=ratio * other.level, force=ratio * other.force, value=ratio * other.value)
    single = join_tables([one, replace(twice, repeat=one.repeat)])
    sensors = tuple(replace(sensor, noise=(NOISE, 0.0)) for sensor in campaign.sensors)
    result = compare(read_case(BEAM).setup, replace(campaign, measurement=single, sensors=sensors))
    np.testing.assert_allclose(result.train.deviation, NOISE * np.abs(result.train.measured), rtol=1e-9)
    assert "not linear" not in next(make_linearity_sections(result, Drawing.of(result))).text


def test_readings_without_calibration_are_drawn_in_their_own_unit() -> None:
    campaign = compared().campaign
    volts = replace(campaign.sensors[0], calibrated=False, reading_unit="V")
    angle = replace(campaign.sensors[1], direction="rz")
    of = Drawing.of(replace(compared(), campaign=replace(campaign, sensors=(volts, angle, *campaign.sensors[2:]))))
    panels = {panel.key: panel for panel in of.panels[False]}
    assert [(panels[name, 1].unit, panels[name, 1].scale) for name in ("tip", "mid")] == [("V/N", 1.0), ("rad/N", 1.0)]


def test_the_page_begins_with_the_worst_sensor_and_names_it() -> None:
    text = make_page(compared(1.2), drawing(1.2))
    data = data_of(text)["sections"][0]["data"]
    assert data["panels"][data["first"]]["label"].startswith("mid")
    assert "The worst sensor is mid" in text
    assert summarise(compared(1.2)).tone == "missing"
    assert summarise(compared()).tone == "nothing"


@pytest.mark.parametrize(("ratio", "percent"), [(3.0, "200 %"), (1.15, "15 %")])
def test_an_error_of_the_amplitude_within_wide_deviations_is_no_agreement(ratio: float, percent: str) -> None:
    of = compared(1.2)
    wide = replace(of.train, whitened=0 * of.train.whitened, predicted=ratio * of.train.measured)
    summary = summarise(replace(of, train=wide))
    assert summary.tone == "ambiguous"
    assert "are not sufficient" in summary.tag
    assert percent in summary.tag


@pytest.mark.parametrize(("degrees", "tone"), [(52.0, "ambiguous"), (6.0, "ambiguous"), (5.0, "nothing")])
def test_an_error_of_the_phase_within_wide_deviations_is_no_agreement(degrees: float, tone: str) -> None:
    """Phases that count from something else in each repeat scatter by as much; 5.7 deg are 10 % of a value."""
    of = compared()
    turned = replace(of.train, predicted=np.exp(1j * np.radians(degrees)) * of.train.measured)
    summary = summarise(replace(of, train=turned))
    assert summary.tone == tone
    assert (f"of the phase is {degrees:.0f} deg" in summary.tag) is (tone == "ambiguous")


def test_readings_that_do_not_stand_out_of_their_scatter_are_no_agreement() -> None:
    of = compared()
    summary = summarise(replace(of, train=replace(of.train, deviation=np.abs(of.train.measured))))
    assert summary.tone == "ambiguous"
    assert "no reading exceeds" in summary.tag


def test_a_gain_that_is_not_told_from_zero_is_no_agreement() -> None:
    gain = Calibrated(name="gain of drive", factor=0.046, deviation=0.13)
    assert "gain of drive 0.046" in summarise(replace(compared(), calibrated=(gain,))).tag
    told = summarise(replace(compared(), calibrated=(replace(gain, deviation=0.001),)))
    assert told.tone == "nothing"


def test_the_headline_names_what_was_not_compared() -> None:
    features = Features(label=("kt",), unit=("N/m",), value=np.ones(1), deviation=np.ones(1))
    loop = DataComparison(
        name="hysteresis", type="loop", held_out=False, features=features, predicted=np.array([np.nan]),
        reason='no place "joint"',
    )  # fmt: skip
    summary = summarise(replace(compared(), data=(loop,)))
    assert summary.tone == "ambiguous"
    assert "not loop hysteresis" in summary.tag


def test_states_that_are_not_compared_are_named_with_the_reason() -> None:
    result = compared()
    assert not any("Not compared" in sentence for sentence in describe_left_out(result))
    table = result.campaign.measurement
    jumps = (table.level == 3) & (table.frequency == FREQUENCY[4]) & (table.repeat <= N_REPEAT / 2)
    apart = replace(result.campaign, measurement=replace(table, value=np.where(jumps, -0.3 * table.value, table.value)))
    (sentence,) = (item for item in describe_left_out(replace(result, campaign=apart)) if "Not compared" in item)
    assert "3 N at 472 Hz; there repeats" in sentence
    # Of a level that is held out, and that no held-out repeat has.
    trained = result.train.where(np.asarray(result.train.points.level == 1))
    (sentence,) = (item for item in describe_left_out(replace(result, train=trained)) if "Not compared" in item)
    assert "3 N at 462.56 Hz, 3 N at 467.28 Hz, 3 N at 469.64 Hz and 6 more; their level is held out" in sentence


def test_states_that_were_read_only_before_contacts_settled_are_named_with_that_reason() -> None:
    result = compared()
    table = result.campaign.measurement
    # A drift that falls off fast: repeats 2 to 4 are settled, and one state is of repeat 1 alone.
    runs_in = np.array([1.3, 1.06, 1.01, 1.0])[table.repeat.astype(int) - 1]
    once = (table.level != 3) | (table.frequency != FREQUENCY[4]) | (table.repeat == 1)
    settling = replace(
        result.campaign,
        tests=(Test(name="stepped", settling=True),),
        measurement=replace(table, value=table.value * runs_in).where(once),
    )
    (sentence,) = (item for item in describe_left_out(replace(result, campaign=settling)) if "Not compared" in item)
    assert "3 N at 472 Hz; all of their readings are of repeats before the contacts settled" in sentence


def test_the_size_of_all_differences_is_not_in_the_unit_of_that_of_a_point() -> None:
    result = compared(1.1)
    text, size = format_report(result), f"{summarise_misfit(result.train).whitened:.3g}"
    assert text.count(f"{size} times as large") == 2
    assert f"{size} standard deviations" not in text


def test_a_headline_does_not_agree_with_the_measurements_where_other_data_differ() -> None:
    features = Features(label=tuple("abcd"), unit=("Hz",) * 4, value=np.ones(4), deviation=np.ones(4))
    decay = DataComparison(
        name="decay", type="ring-down", held_out=False, features=features, predicted=np.array([5.0, 1, 5, 1])
    )
    # The root mean square of 4, 0, 4 and 0 standard deviations is 2.83.
    summary = summarise(replace(compared(), data=(decay,)))
    assert summary.tone == "missing"
    assert summary.tag.startswith(
        "The model agrees with the steady states, but differs from ring-down decay (2.83 standard deviations)"
    )
    near = replace(decay, predicted=np.array([2.0, 0, 1, 1]))
    assert summarise(replace(compared(), data=(near,))).tone == "nothing"


def test_a_headline_does_not_agree_with_steady_states_that_look_wrong() -> None:
    swapped = Suspicion(where='sensors "tip" and "mid" look swapped', sentence="")
    single = Suspicion(where="campaign", sentence="one repeat", remark=True)
    summary = summarise(replace(compared(), suspicions=(single, swapped)))
    assert summary.tone == "ambiguous"
    assert summary.tag.endswith(f"look wrong: {swapped.where}")
    assert summarise(replace(compared(), suspicions=(single,))).tone == "nothing"


def test_sections_of_a_command_are_shown_and_parts_without_data_are_not() -> None:
    section = Section(
        title="Loops", text="Work per cycle.", table=Table(head=("level", "J"), rows=[["1 N", "0.5"]]),
        pictures={"a loop": b"\x89PNG"}, plots=[{"data": [], "layout": {}}], html="<b>more</b>",
    )  # fmt: skip
    bare = replace(compared(), peaks=(), sections=(section,))
    motions = {
        free: [item for item in panels if isinstance(item.sensor, Sensor)] for free, panels in drawing().panels.items()
    }
    text = make_page(bare, replace(drawing(), panels=motions))
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert titles == [
        "Measured and predicted responses", "Where the model fails", "Linearity over levels", "Loops",
        "What was compared",
    ]  # fmt: skip
    assert "data:image/png;base64,iVBORw==" in text
    assert "<b>more</b>" in text
    assert "Work per cycle." in text
    assert 'id="plot3-0"' in text


def peak(level: float, frequency: float, predicted: float, damping: float = 0.01) -> PeakError:
    return PeakError(
        free=False, level=level, sensor="tip", frequency=frequency, predicted_frequency=predicted,
        frequency_deviation=0.05, damping=damping, predicted_damping=damping, damping_deviation=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("peaks", "words"),
    [
        # 0.1 Hz is two standard deviations.
        ([(1.0, 100.0, 100.1)], ["agrees within 0.1 %"]),
        (
            [(1.0, 100.0, 101.0), (5.0, 99.0, 100.5)],
            ["1 to 1.5 % too high", "falls by 1 Hz", "by 0.5 Hz", "softens less"],
        ),
        ([(1.0, 100.0, 99.0), (5.0, 99.0, 99.0)], ["1 % too low at 1 kN", "the model does not soften"]),
        ([(1.0, 100.0, 99.0), (5.0, 100.0, 101.0)], ["-1 to +1 %", "the model hardens more"]),
        ([(1.0, 100.0, 101.0), (5.0, 99.0, 102.0)], ["the model hardens with the level, the specimen softens"]),
    ],
)
def test_resonances_are_described_by_what_is_more_than_chance(
    peaks: list[tuple[float, float, float]], words: list[str]
) -> None:
    text = " ".join(describe_resonances([peak(*item) for item in peaks], "kN"))
    for word in words:
        assert word in text


def test_an_error_that_the_readings_do_not_resolve_is_not_explained_by_chance() -> None:
    coarse = replace(peak(1.0, 100.0, 100.6), frequency_deviation=0.8, damping_deviation=0.02)
    coarse = replace(coarse, predicted_damping=0.025)
    (told,) = describe_resonances([coarse], agrees=False)
    assert "differs by up to 0.6 % (one standard deviation: up to 0.8 %)" in told
    assert "its damping differs by up to 150 %, but the readings do not determine it" in told
    (told,) = describe_resonances([coarse])
    assert "agrees within 0.6 %, which chance explains" in told
    assert "its damping differs by up to 150 %, but the readings do not determine it" in told


def test_levels_that_a_resonance_was_read_at_are_named_where_others_were_not() -> None:
    peaks = [peak(1.0, 100.0, 100.1)]
    assert "(read at 1 N only)" in "".join(describe_resonances(peaks, levels={False: [1.0, 5.0]}))
    assert "read at" not in "".join(describe_resonances(peaks, levels={False: [1.0], True: [5.0]}))


def test_damping_that_is_written_alike_does_not_change() -> None:
    text = " ".join(describe_resonances([peak(1.0, 100.0, 101.0, 0.00361), peak(5.0, 99.0, 100.5, 0.00362)], "kN"))
    assert "the damping ratio stays at 0.36 % in the measurement and at 0.36 % in the model" in text
    assert "is 140 % too high" in " ".join(describe_resonances([peak(1.0, 100.0, 237.2)]))


def test_what_is_round_off_of_a_linear_model_is_no_change() -> None:
    text = " ".join(describe_resonances([peak(1.0, 100.0, 99.5), peak(5.0, 97.0, 99.5 + 1e-14)]))
    assert "falls by 3 Hz in the measurement and stays in the model" in text
    assert text.endswith("the model does not soften with the level.")


def test_each_mode_has_its_own_sentences_and_its_own_plot() -> None:
    first = [peak(1.0, 30.0, 30.3), peak(5.0, 29.0, 29.3)]
    second = [replace(peak(level, 71.0, 70.0), mode=2) for level in (1.0, 5.0)]
    third = replace(peak(5.0, 90.0, np.nan), mode=3, predicted_damping=np.nan)
    # By level, as they are measured.
    every = [first[0], second[0], first[1], second[1], third]
    told = list(describe_resonances(every, levels={False: [1.0, 5.0]}))
    assert ["1 % too high" in text for text in told] == [True, False, False, False]
    assert ["near 29.5 Hz" in text for text in told] == [True, False, False, False]
    assert "falls by 1 Hz in the measurement and by 1 Hz in the model" in told[1]
    assert "near 71 Hz is 1.4 % too low" in told[2]
    assert "no resonance in the measured band" in told[3]
    assert "near 90 Hz" in told[3]
    plots = draw_backbones({"drawn": every[:1], "predicted": every}, "N")
    assert [plot["layout"]["xaxis"]["title"]["text"] for plot in plots] == [
        "level [N], jointed near 29.5 Hz", "level [N], jointed near 71 Hz", "level [N], jointed near 90 Hz"
    ]  # fmt: skip
    drawn, predicted, measured = plots[0]["data"][:3]
    assert (drawn["y"], predicted["y"], measured["y"]) == ([30.3], [30.3, 29.3], [30.0, 29.0])
    assert plots[2]["data"][1]["y"] == [None]


def test_a_resonance_without_a_known_deviation_is_not_called_an_error() -> None:
    unknown = replace(peak(1.0, 100.0, 101.0), frequency_deviation=np.nan)
    (sentence,) = describe_resonances([unknown])
    assert "unknown standard deviation" in sentence


def test_the_page_begins_where_the_model_fails_and_else_with_the_sensor_that_moves_most() -> None:
    def first(gain: float) -> str:
        (section,) = make_response_sections(compared(gain), drawing(gain))
        return str(section.data["panels"][section.data["first"]]["label"])

    assert first(1.1) == "mid, fundamental"
    table = compared().campaign.measurement
    largest = {name: np.abs(table.value[table.sensor == number]).max() for number, name in enumerate(SENSORS[:2])}
    assert first(1.0) == f"{max(largest, key=lambda name: largest[name])}, fundamental"
