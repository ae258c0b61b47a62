"""Thresholds belong to a layout: what is measured and asked, whatever the values are."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from correlation.campaign.measurement import HeldOut
from correlation.campaign.read_campaign import read_campaign
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import Thresholds
from pipeline.progress import SilentProgress
from pipeline.store import Store
from study.case.added import list_case_effects
from study.case.setup import read_case
from study.diagnose import round as diagnose_round
from study.diagnose import thresholds as diagnose_limits
from study.diagnose.null_campaign import null_campaign
from study.diagnose.round import diagnose_case, simulate_thresholds
from study.diagnose.ship_thresholds import write_shipped_thresholds
from study.diagnose.thresholds import are_simulated, find_shipped_thresholds, hash_layout, layout
from study.shipped_cases import BEAM
from tests.slow import slow

TwoMasses = Callable[..., Path]
OWN = Path(__file__).parents[2] / "examples" / "effects" / "exciter_third_harmonic.py"


def test_the_shipped_thresholds_are_those_of_the_shipped_beam() -> None:
    # A renamed effect or calibration parameter would lose them without a word.
    setup = read_case(BEAM).setup
    ((key, entry),) = json.loads(diagnose_limits.SHIPPED.read_text(encoding="utf-8")).items()
    assert hash_layout(entry["layout"]) == key
    assert entry["layout"]["candidates"] == sorted(
        list_case_effects(setup.model, setup.effect_files, without=setup.without).names
    )
    assert entry["layout"]["accepted"] == [item.name for item in setup.calibration_parameters]


@slow
def test_a_new_layout_is_measured_once(two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch) -> None:
    # A few candidates are enough to be limited.
    text = (
        f'{two_masses({}).read_text()}[effects]\nwithout = ["spring", "dashpot", "cubic", "air damping", "density"]\n'
    )
    case, folder, store = two_masses({"mass at tip": 0.006}, case=text), Path("campaign"), Store(Path("kept"))
    said: list[str] = []

    def diagnosed() -> Thresholds:
        campaign = read_campaign(folder)
        setup = read_case(case, campaign).setup
        return diagnose_case(setup, campaign, trials=2, store=store, announce=said.append).diagnosis.thresholds

    first = diagnosed()
    assert first.n_trial == 2
    # The largest of a handful of squares of standard normals, 1 % of the time; two trials tell it roughly.
    assert first.gain < 60
    (announced,) = said
    assert "detection thresholds of this layout" in announced
    assert "2 simulated campaigns" in announced
    assert "without --trials" in announced
    monkeypatch.setattr("pipeline.pool.worker_pool", lambda *_: pytest.fail("a trial is made again"))
    # What is shipped is the same, and is found.
    shipped = Path("thresholds.json")
    assert write_shipped_thresholds(case, folder, 2, store, SilentProgress(), shipped) == first
    with monkeypatch.context() as patched:
        patched.setattr(diagnose_limits, "SHIPPED", shipped)
        campaign = read_campaign(folder)
        setup = read_case(case, campaign).setup
        assert find_shipped_thresholds(setup, campaign, setup.without) == first
    # Another campaign of the same layout.
    two_masses({"mass at base": 0.006}, case=text)
    assert diagnosed() == first
    assert len(said) == 1


def test_a_campaign_whose_kept_result_is_damaged_is_not_measured(tmp_path: Path) -> None:
    told: list[str] = []
    store = Store(tmp_path, told.append)

    def made(layout: str, seed: int, simulation: object, effects: object) -> dict[str, float]:
        return {"seed": seed, "gain": 1.0, "misfit": 1.0}

    made.__module__ = null_campaign.compute.__module__  # on whose code the key depends
    trial = replace(null_campaign, compute=made)  # type: ignore[arg-type]
    for seed in range(2):
        store.run(trial, "abc", seed, simulation=None, effects=())  # type: ignore[arg-type]
    assert are_simulated("abc", 2, store)
    file = next(tmp_path.glob("objects/*/*.npz"))
    file.write_bytes(file.read_bytes()[:-1])
    assert not are_simulated("abc", 2, store)
    (sentence,) = told
    assert sentence.startswith("a stored result is damaged and will be computed again: campaign without any effect in ")


def test_effects_of_ones_own_are_found_in_finer_models(two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch) -> None:
    setup, campaign = read_case(two_masses({})).setup, read_campaign(Path("campaign"))
    setup, asked = replace(setup, effect_files=(OWN,)), {}
    monkeypatch.setattr(diagnose_round, "arrange", lambda *_, **options: asked.update(options))
    monkeypatch.setattr(diagnose_round, "simulate_layout_thresholds", lambda *_: Thresholds(gain=1.0, misfit=1.0))
    simulate_thresholds(setup, campaign, (), 2, compute_step, Store(None), SilentProgress(), None)
    finer = setup.model.with_system(mass=1.001 * setup.model.system.mass)
    known, expected = asked["catalogue_of"](finer), replace(setup, model=finer).candidates(campaign)
    assert "third harmonic of the exciter" in known.names
    assert known.names == expected.names
    assert known.effect("mass at tip").parameters == expected.effect("mass at tip").parameters


def test_a_layout_is_known_by_its_design_and_not_by_its_values(
    two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    setup, campaign = read_case(two_masses({})).setup, read_campaign(Path("campaign"))
    known = setup.candidates(campaign)
    key = hash_layout(layout(setup, campaign, known))
    louder = replace(campaign, measurement=replace(campaign.measurement, value=1.1 * campaign.measurement.value))
    assert hash_layout(layout(setup, louder, known)) == key
    others = [
        layout(setup, replace(campaign, held_out=HeldOut(repeats=(5,))), known),
        layout(setup, replace(campaign, measurement=campaign.measurement.where(campaign.measurement.level < 5)), known),
        layout(replace(setup, calibration_parameters=setup.calibration_parameters[:1]), campaign, known),
        layout(replace(setup, budget=replace(setup.budget, shares=0.123)), campaign, known),
        layout(setup, campaign, setup.candidates(campaign, ["cubic"])),
    ]
    assert len({key, *map(hash_layout, others)}) == 6

    assert find_shipped_thresholds(setup, campaign, ()) is None
    shipped = tmp_path / "thresholds.json"
    shipped.write_text(
        json.dumps({key: {"thresholds": {"gain": 15.5, "misfit": 20.0, "n_trial": 300}}}), encoding="utf-8"
    )
    monkeypatch.setattr(diagnose_limits, "SHIPPED", shipped)
    result = Thresholds(gain=15.5, misfit=20.0, n_trial=300)
    assert find_shipped_thresholds(setup, campaign, ()) == result
    # Those of all candidates hold for fewer, too.
    assert find_shipped_thresholds(setup, campaign, ("cubic",)) == result
