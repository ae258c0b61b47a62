"""`stickslip compare --limits` as a user runs it: a model's own campaign lies within, a spoilt sensor leaves."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, Drive
from correlation.campaign.write_campaign import write_campaign
from correlation.family.family import measured_families
from correlation.family.frequencies import choose_frequencies
from correlation.model import Model
from study import cli
from study.bench.repeat import open_bench
from study.case.setup import Setup
from study.compare.families import FamilyComparison, select_families
from study.compare.family_calibration import compare_with_families
from study.shipped_cases import BEAM
from tests.study.conftest import TwoMasses
from tests.study.test_compare_run import JOINTED, measured_from_the_model, setup

#: A small search: this tests what is told, and not how hard is searched.
LIMITS = "\n[limits]\npopulation = 4\nsamples = 4\n"
LEVEL = 3.0


def small(campaign: Campaign) -> Campaign:
    """One level of the jointed test, at every other frequency."""
    table = campaign.measurement
    kept = (table.level == LEVEL) & (table.test == 0) & np.isin(table.frequency, JOINTED[::2])
    return replace(campaign, measurement=table.where(kept), tests=campaign.tests[:1])


def compared(home: Path, campaign: Campaign, capfdbinary: pytest.CaptureFixture[bytes]) -> Mapping[str, Any]:
    shutil.copytree(BEAM.parent, home / "beam", dirs_exist_ok=True)
    case = home / "beam" / BEAM.name
    case.write_text(BEAM.read_text(encoding="utf-8") + LIMITS, encoding="utf-8")
    write_campaign(campaign, home / "campaign")
    assert cli.main(["compare", str(case), "campaign", "--limits", "--out", "out", "--json"]) == 0
    document: Mapping[str, Any] = json.loads(capfdbinary.readouterr().out)
    return document


@pytest.fixture
def small_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the measured frequencies alone."""
    monkeypatch.setattr(
        "study.compare.families.choose_frequencies", lambda families, most, _: choose_frequencies(families, most, 0)
    )


@pytest.mark.usefixtures("small_search")
def test_the_models_own_campaign_lies_within_and_a_spoilt_sensor_leaves(
    at_home: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    campaign = small(measured_from_the_model())
    document = compared(at_home, campaign, capfdbinary)
    families = document["families"]
    assert families["all_within"]
    assert any("All 5 repeats" in item for item in families["sentences"])
    # Motions with their fundamental, the force with its static part as well; all readings are compared.
    assert {(item["sensor"], item["harmonic"]) for item in families["families"]} == {
        ("tip", 1), ("mid", 1), ("left_T", 0), ("left_T", 1),
    }  # fmt: skip
    table = campaign.measurement
    assert sum(item["n_compared"] for item in families["families"]) == (
        int(((table.harmonic == 1) | ((table.harmonic == 0) & (table.sensor == 2))).sum())
    )
    assert all(item["coverage"] > 0.95 for item in families["families"])
    assert any("harmonic 3 of tip, mid" in item for item in families["not_compared"])
    assert {Path(file).name for file in families["files"]} == {
        f"beam_compare_families_{name}.png" for name in ("tip", "mid", "left")
    }
    assert set(families["files"]) <= set(document["files"])
    assert not list((at_home / "out").glob(".*.part"))

    # The bench finds the same limits, in the units of its panels.
    bench = open_bench(at_home / "beam" / BEAM.name, at_home / "campaign")
    panels = bench.compare().views["responses"]["panels"]
    result = bench.limits()
    assert result.numbers["families that leave their limits [-]"] == 0
    for panel, (band,) in zip(panels, result.views["limits"]["panels"], strict=True):
        if panel["harmonic"] != 1:
            continue  # a limit of a static part is that of a force
        (group,) = panel["groups"]
        assert band["frequency"] == pytest.approx(group["frequency"])
        margin = 5 * np.array(group["deviation"])  # noise of the means
        assert (np.array(band["lower"]) < np.array(group["amplitude"]) + margin).all()
        assert (np.array(band["upper"]) > np.array(group["amplitude"]) - margin).all()

    spoilt = small(measured_from_the_model(1.1))
    families = compared(at_home, spoilt, capfdbinary)["families"]
    assert not families["all_within"]
    assert {item["sensor"] for item in families["families"] if item["leaves"]} == {"mid"}
    (mid,) = [item for item in families["families"] if item["sensor"] == "mid"]
    assert {item["side"] for item in mid["departures"]} == {"upper"}


def test_a_model_without_friction_has_no_limits_and_says_so(
    two_masses: TwoMasses, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    case = two_masses({})
    assert cli.main(["compare", str(case), "campaign", "--limits", "--json"]) == 0
    families = json.loads(capfdbinary.readouterr().out)["families"]
    assert families["families"] == []
    assert any("no sliders" in item for item in families["not_compared"])


def test_a_calibration_onto_families_begins_with_the_calibration_parameters_alone(
    two_masses: TwoMasses, capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gain of a sensor without calibration is fitted to the mean as well, but is no parameter of the case."""
    case = two_masses({})
    manifest = case.parent / "campaign" / "campaign.toml"
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(text.replace('name = "base"', 'name = "base"\ncalibrated = false', 1), encoding="utf-8")
    begun: list[int] = []

    def fitted(model: Model, setup: Setup, *rest: Any) -> FamilyComparison:
        begun.extend([len(setup.calibration_parameters), len(rest[-1])])
        return compare_with_families(model, setup, *rest)

    monkeypatch.setattr("study.compare.family_calibration.compare_with_families", fitted)
    assert cli.main(["compare", str(case), "campaign", "--calibrate-families", "--json"]) == 0
    document = json.loads(capfdbinary.readouterr().out)
    assert any("base" in name for name in document["calibrated"])
    assert begun[0] == begun[1] == len(document["calibrated"]) - 1


def test_what_has_no_limits_is_named() -> None:
    campaign = measured_from_the_model()
    families = measured_families(campaign)
    volts = replace(campaign, drive=Drive(unit="V", calibrated=False))
    chosen, sentences = select_families(setup().model, volts, families)
    assert chosen == ()
    assert any("V" in item for item in sentences)
    loose = replace(campaign, sensors=(replace(campaign.sensors[0], calibrated=False), *campaign.sensors[1:]))
    chosen, sentences = select_families(setup().model, loose, families)
    assert {item.sensor for item in chosen} == {"mid", "left_T"}
    assert any("tip" in item for item in sentences)
    assert np.isin([item.harmonic for item in chosen], (0, 1)).all()


def test_limits_of_the_relative_motion_are_not_laid_over_readings_of_the_absolute_one() -> None:
    campaign, model = measured_from_the_model(), setup().model
    families = measured_families(campaign)
    shaken = replace(model, base_acceleration=np.ones(model.system.n_dof)).with_sensor("mid", relative=True)
    chosen, sentences = select_families(shaken, campaign, families)
    # The force of a contact is that of the relative motion.
    assert {item.sensor for item in chosen} == {"mid", "left_T"}
    (sentence,) = [item for item in sentences if "base" in item]
    assert "tip" in sentence
    assert "mid" not in sentence
