"""Manifests drafted from files of test programs: what is recognised, what is assumed, and that they can be read."""

import os
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.read_campaign import check_campaign, read_campaign
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from correlation.modal.fit_modes import Modes, fit_modes
from pipeline.store import Store
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions, Marked, Question
from study.measured_campaign import keep_analyses
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv

DATA = os.environ.get("STICKSLIP_DATA", "")


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


def test_of_channels_that_are_all_voltages_one_is_a_response(tmp_path: Path) -> None:
    size = np.abs(receptance(FREQUENCY))
    write_csv(tmp_path / "d.csv", "f [Hz],Voltage_0 [V],Voltage_1 [V]", FREQUENCY, size, 0.5 * size)
    _, manifest = drafted(tmp_path)
    assert [sensor["calibrated"] for sensor in manifest["sensor"]] == [False, False]


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


def test_a_draft_that_cannot_be_read_is_left_to_be_edited(tmp_path: Path) -> None:
    f, size = np.tile(FREQUENCY, 2), np.abs(np.concatenate([receptance(FREQUENCY), 3 * receptance(FREQUENCY)]))
    write_csv(tmp_path / "stack.csv", "f [Hz],acc tip amplitude [g],repeat", f, size, 1 + 0 * f)
    measured = read_folder(tmp_path)
    draft = draft_campaign(measured, Assumptions())
    with pytest.raises(CampaignError, match=r"or its level if these are levels.*the draft with all entries is in"):
        write_manifest(measured, draft)
    assert len(tomllib.loads((tmp_path / "campaign.toml").read_text())["run"]) == 1


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
        with pytest.raises(CampaignError, match="already exists"):
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


def test_amplitudes_in_decibels_are_drafted_with_their_unit(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    write_csv(tmp_path / "frf.csv", "f [Hz],|H| [dB re 1 (m/s^2)/N],phase [deg]", FREQUENCY, 20 * np.log10(abs(h)),
              np.degrees(np.angle(h)))  # fmt: skip
    measured = read_folder(tmp_path)
    write_manifest(measured, draft_campaign(measured, Assumptions()))
    text = (tmp_path / "campaign.toml").read_text()
    manifest = tomllib.loads(text)
    assert manifest["sensor"][0]["quantity"] == "acceleration"
    assert "is taken as 20 log10 of an amplitude" in text
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


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Arguments of the fits of modes that are made."""
    made: list[Any] = []

    def fit(*args: Any, **words: Any) -> Modes:
        made.append(args)
        return fit_modes(*args, **words)

    monkeypatch.setattr("correlation.data_type.response_modes.fit_modes", fit)
    return made


def write_response(folder: Path) -> None:
    h = receptance(FREQUENCY)
    write_csv(folder / "frf.csv", "f [Hz],a re [m/N],a im [m/N]", FREQUENCY, h.real, h.imag)


def test_a_draft_that_is_tried_again_without_an_entry_fits_modes_once(tmp_path: Path, fits: list[Any]) -> None:
    write_response(tmp_path)
    time = np.arange(2000) / 2000
    decay = np.exp(-6 * time) * np.cos(2 * np.pi * 60 * time)
    # An impulse response has no unit of a motion.
    write_csv(tmp_path / "released.csv", "time [s],acc tip [g_n/N]", time, decay)
    draft = draft_campaign(measured := read_folder(tmp_path), Assumptions())
    assert len(draft.entries["ring_down"]) == 1
    write_manifest(measured, draft)
    assert not draft.entries["ring_down"]
    assert len(fits) == 1


def test_modes_that_a_draft_fitted_are_there_for_all_later_commands(tmp_path: Path, fits: list[Any]) -> None:
    folder = tmp_path / "measured"
    folder.mkdir()
    write_response(folder)
    analyse = keep_analyses(Store(tmp_path / "store"))
    write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()), analyse)
    (response,) = read_campaign(folder, analyse).data
    assert len(fits) == 1
    (anew,) = read_campaign(folder).data
    assert len(fits) == 2
    assert [mode.frequency for mode in anew.modes] == [mode.frequency for mode in response.modes]
    np.testing.assert_array_equal(anew.fit.stabilisation.pole, response.fit.stabilisation.pole)


def test_an_array_of_responses_has_a_sensor_per_output_and_one_input(tmp_path: Path) -> None:
    h = receptance(FREQUENCY)
    table = h[:, None, None] * np.array([[1.0, 0.5], [0.7, -0.2]])
    scipy.io.savemat(tmp_path / "frf.mat", {"f": FREQUENCY, "H": table})
    campaign, manifest = drafted(tmp_path)
    (frf,) = manifest["frf"]
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["h 1", "h 2"]
    assert set(frf["columns"]) == {"frequency", "h 1", "h 2"}
    assert any("input 2" in sentence for sentence in campaign.draft.left_out)


def test_a_dead_channel_is_left_out_and_the_others_stay(tmp_path: Path) -> None:
    x = receptance(FREQUENCY)
    header = "f [Hz],F [N],a re [m],a im [m],dead amplitude [m],lost amplitude [m]"
    write_csv(tmp_path / "one.csv", header, FREQUENCY, ONES, x.real, x.imag, ONES, 2 * ONES)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["a displacement"]
    told = [sentence for sentence in campaign.draft.left_out if "a dead channel" in sentence]
    assert [sentence.count("a dead channel") for sentence in told] == [1, 1]  # each in a sentence of its own


def test_records_of_one_channel_share_a_sensor_without_a_word(tmp_path: Path) -> None:
    time = np.arange(400) / 1000
    for seed in (1, 2):
        noise = np.random.default_rng(seed).normal(size=(2, 400))
        write_csv(tmp_path / f"noise_{seed}.csv", "t [s],force [N],Acc tip (g)", time, *noise)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["Acc tip (g)"]
    assert not campaign.draft.left_out


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
