"""Campaigns are made once each, whatever interrupts them; what a diagnosis says reaches the record."""

import math
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.hidden_effects import main
from benchmarks.hidden_effects_campaign import examine, excluded_kinds, floors, kind_of
from benchmarks.hidden_effects_groups import Groups
from benchmarks.hidden_effects_plan import ROWS, Case, cases, effect_name, effect_value
from benchmarks.hidden_effects_record import FAILED, MISSING, NONE, Planted, Record, read
from benchmarks.hidden_effects_run import run
from benchmarks.hidden_effects_setup import setup
from correlation.feature.vector import FeatureVector
from correlation.noise.covariance import Whitening
from correlation.prediction import Points
from diagnosis.candidate.catalogue import list_effects
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.diagnose import Diagnosis
from diagnosis.fit.problem import Refit
from diagnosis.localisation import UnknownForcePlace
from tests.slow import slow
from transient.virtual_bench.beam import BeamParameters
from transient.virtual_bench.campaign import CampaignPoints
from transient.virtual_bench.effect import KINDS, HiddenEffect
from transient.virtual_bench.hidden_effect import HiddenEffectRecord, make_campaign

NO_GROUPS = Groups(same=0.9, pairs={frozenset(("cubic at tip", "spring at tip")): 0.95})


def quick(case: Case, folder: Path) -> Record:
    (folder / f"{case.row}_{case.seed}.made").touch(exist_ok=False)  # twice would be an error
    return Record(row=case.row, seed=case.seed, planted=Planted(kind=case.kind), finding=NONE)


def dying(case: Case, folder: Path) -> Record:
    if case.seed % 4 == 3:
        raise KeyboardInterrupt
    return quick(case, folder)


def test_an_interrupted_run_goes_on_where_it_was(tmp_path: Path) -> None:
    planned = cases(3, 5, 7000)
    with pytest.raises(KeyboardInterrupt):
        run(planned, tmp_path, dying, workers=0, say=lambda _: None)
    file = tmp_path / "records.jsonl"
    before = file.read_text()
    assert 0 < len(read(file)) < len(planned)
    records = run(planned, tmp_path, quick, workers=0, say=lambda _: None)
    assert sorted((item.row, item.seed) for item in records) == sorted((case.row, case.seed) for case in planned)
    assert file.read_text().startswith(before)
    said: list[str] = []
    run(planned, tmp_path, quick, workers=0, say=said.append)
    assert said == [f"35 of 35 campaigns are there, 0 to make ({file})"]


def test_no_campaign_begins_after_the_time_given(tmp_path: Path) -> None:
    said: list[str] = []
    assert run(cases(1, 1, 0), tmp_path, quick, workers=0, most_seconds=0.0, say=said.append) == []
    assert said[-1] == "11 campaigns are left: run it again to go on"


def test_what_failed_is_tried_again_if_asked(tmp_path: Path) -> None:
    def failing(case: Case, folder: Path) -> Record:
        return replace(Record(row=case.row, seed=case.seed, planted=Planted(kind=case.kind), finding=FAILED))

    planned = cases(1, 1, 0, ["mass"])
    run(planned, tmp_path, failing, workers=0, say=lambda _: None)
    assert run(planned, tmp_path, quick, workers=0, say=lambda _: None)[0].finding == FAILED
    assert run(planned, tmp_path, quick, workers=0, again=True, say=lambda _: None)[0].finding == NONE


SCRIPT = """\
import time
from pathlib import Path
from benchmarks.hidden_effects import main
from benchmarks.hidden_effects_groups import Groups
from benchmarks.hidden_effects_record import NONE, Planted, Record

def work(case, folder):
    import os
    assert os.environ["OMP_NUM_THREADS"] == "1"
    if not (folder / "died").exists():
        (folder / "died").touch()
        os._exit(9)  # as if it were killed for lack of memory: the case is tried again in a fresh process
    if case.seed > 0:
        (folder / "waits").touch()
        time.sleep(600)
    return Record(row=case.row, seed=case.seed, planted=Planted(kind=case.kind), finding=NONE)

if __name__ == "__main__":
    try:
        main(["--only", "mass", "--seeds", "2", "--first-seed", "0", "--workers", "1", "--folder", "out"], work,
             Groups(same=0.9, pairs={}))
    except KeyboardInterrupt:
        raise SystemExit(7)
"""


@slow
def test_a_process_may_die_and_ctrl_c_ends_all_and_keeps_what_is_done(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    root = Path(__file__).parents[2]
    process = subprocess.Popen(
        [sys.executable, str(script)], cwd=tmp_path, env={"PYTHONPATH": str(root), "PATH": ""},
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        while not (tmp_path / "out" / "waits").exists():
            assert process.poll() is None
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        # It ends although its worker would sleep for ten minutes.
        _, error = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, error) == (7, b"")
    assert [item.seed for item in read(tmp_path / "out" / "records.jsonl")] == [0]


def test_every_planted_effect_has_its_name_in_the_catalogue() -> None:
    base = setup().model
    names = list_effects(base, level=10.0).names
    for kind, _ in ROWS.values():
        for place in KINDS.get(kind, ()):
            name = effect_name(truth(kind, place), base)
            assert (name in names) == (kind != "stop")
    assert effect_name(truth("gap", "right"), base) == "gap of right at right.3"


def test_a_planted_strength_is_told_in_the_unit_of_the_catalogue() -> None:
    # The base has 24 N; a specimen's friction coefficients are its own.
    assert effect_value(truth("preload", "left", 1.2)) == pytest.approx(1.05)
    rough = BeamParameters(friction_coefficient=(0.48, 0.48))
    left = truth("friction", "left", 0.048, rough)
    right = truth("friction", "right", 0.048, rough)
    assert effect_value(left) == pytest.approx(1.1)
    assert effect_value(right) == pytest.approx(1 / 1.1)
    assert effect_value(truth("mass", "tip", 3e-5)) == 3e-5


def test_an_effect_is_left_out_with_the_kinds_of_its_group() -> None:
    assert excluded_kinds("cubic at tip", NO_GROUPS) == ("cubic", "spring")
    assert excluded_kinds("air damping at tip", NO_GROUPS) == ("air damping",)
    assert excluded_kinds("", NO_GROUPS) == ()
    for effect in list_effects(setup().model, level=10.0).candidates:
        assert kind_of(effect.name) == effect.kind


def truth(kind: str, place: str, strength: float = 1.0, parameters: BeamParameters | None = None) -> Any:
    effect = HiddenEffect(kind=kind, place=place, strength=strength)
    return SimpleNamespace(effect=effect, parameters=parameters or BeamParameters())


#: Two states: three motions with a third harmonic, a force and its mean; one motion alone.
VALUE = np.array([3 - 1j, 0.5 + 0.5j, 0.1 + 0.2j, 7 - 3j, 11 + 0j, 2 + 1j])
POINTS = Points(
    free=np.array([False] * 5 + [True]),
    level=np.full(6, 5.0),
    frequency=np.full(6, 20.0),
    sensor=np.array(["a", "b", "a", "T", "N", "a"]),
    harmonic=np.array([1, 1, 3, 1, 0, 1]),
)


def comparison() -> SimpleNamespace:
    motion = np.array([True, True, True, False, False, True])
    features = FeatureVector.choose(POINTS, VALUE, motion)
    measured = features.of_values(VALUE)
    draw = np.random.default_rng(5)
    # The first mode moves a ratio and its reference together.
    modes = np.column_stack([3e-4 * measured, 2e-4 * draw.standard_normal((len(measured), 2))])
    whitening = Whitening(deviation=1e-4 * draw.uniform(0.5, 2.0, len(measured)), modes=modes)
    observed = SimpleNamespace(motion=motion)
    # Three curves of one point each, which count alike.
    shares = np.where(motion & (POINTS.harmonic == 1), 1 / 3, 0.0)
    return SimpleNamespace(
        features=features, measured=measured, whitening=whitening, observed=observed, shares=shares
    )  # fmt: skip


def test_the_floor_is_the_error_of_the_true_model() -> None:
    """Features drawn with their covariance, turned back into readings by hand."""
    held = comparison()
    draw, squares = np.random.default_rng(6), {"all": 0.0, "noise": 0.0}
    n = 4000
    for _ in range(n):
        noise = held.whitening.deviation * draw.standard_normal(len(held.measured))
        shared = held.whitening.modes @ draw.standard_normal(3)
        for name, change in (("noise", noise), ("all", noise + shared)):
            numbers = held.measured + change
            imaginary = np.zeros(6)
            imaginary[held.features.row[6:]] = numbers[6:]
            feature = numbers[:6] + 1j * imaginary
            reading = feature.copy()
            reading[[0, 1, 5]] = 5.0 / feature[[0, 1, 5]]
            reading[3] = feature[3] * reading[0]  # the largest motion of the state is its reference
            chosen = (POINTS.harmonic == 1) & held.observed.motion
            squares[name] += float(np.mean(np.abs(reading / VALUE - 1)[chosen] ** 2)) / n
    expected = (math.sqrt(squares["all"]), math.sqrt(squares["noise"]))
    # 4000 draws of some ten numbers: 1 % is three standard deviations of the mean.
    assert floors(SimpleNamespace(held_out_without_jitter=held)) == pytest.approx(expected, rel=0.02)  # type: ignore[arg-type]


POINTS_TO_MEASURE = CampaignPoints(levels=(1.0, 5.0), frequencies=(472.0,), free_frequencies=(90.0,), n_repeat=4)


def make(folder: Path, *, seed: int, kind: str) -> HiddenEffectRecord:
    return make_campaign(folder, seed=seed, kind=kind, points=POINTS_TO_MEASURE)


def judge(campaign: Any, base: Any, *_: object, without: tuple[str, ...], **__: object) -> Diagnosis:
    """The first candidate of the kind that is looked for, right by its name alone."""
    names = list_effects(base, level=10.0, without=without)
    effect = names.effect("mass at tip")
    before = refit(None, chi2=900.0, held_error=0.02)
    best = refit(effect, chi2=800.0, held_error=0.011)
    verdict = Verdict(
        finding=Finding.MISSING, effects=(best,), baseline=before, threshold=12.0, detectable={}, units={}
    )  # fmt: skip
    place = UnknownForcePlace(
        name="tip", gain=9.0, n_number=4, level=np.ones(2), amplitude=np.ones(2), stiffness=np.ones(2, complex),
        deviation=np.ones(2),
        third=np.zeros(2, complex), exponent=1.0, exponent_deviation=0.1, phase=0.0, configuration="free",
    )  # fmt: skip
    scores = (SimpleNamespace(effect=effect, gain=99.0),)
    return Diagnosis(
        arrangement=SimpleNamespace(held_out_without_jitter=comparison()), catalogue=names, scores=scores,  # type: ignore[arg-type]
        baseline=before, refits=(best,), places=(place,), thresholds=None, verdict=verdict,  # type: ignore[arg-type]
    )  # fmt: skip


def refit(effect: Any, chi2: float, held_error: float) -> Refit:
    fit = SimpleNamespace(values=np.array([1.0, 5e-5]), deviation=np.array([0.1, 2e-6]), chi2=chi2)
    return Refit(
        effect=effect,
        fit=fit,
        held_out_reduced_chi2=1.0,
        error=0.01,
        held_out_error=held_error,
        gain=900.0 - chi2,  # type: ignore[arg-type]
    )


@slow
def test_a_campaign_is_made_judged_recorded_and_deleted(tmp_path: Path) -> None:
    record = examine(Case(row="mass", seed=1000), tmp_path, NO_GROUPS, make=make, judge=judge)
    assert record.failure == ""
    assert (record.finding, record.names, record.planted.effect) == (MISSING, ("mass at tip",), "mass at tip")
    assert (record.ranking[0].gain, record.ranking[0].strength, record.ranking[0].deviation) == (100.0, 5e-5, 2e-6)
    assert record.planted.unit_strength <= record.planted.value <= 4 * record.planted.unit_strength
    assert record.scores == {"mass at tip": 99.0}
    assert record.place is not None
    assert record.place.name == "tip"
    assert record.make_seconds > 0
    assert [*tmp_path.iterdir()] == []
    assert Record.of_line(record.line) == record


def test_a_failure_is_put_on_record_in_a_sentence(tmp_path: Path) -> None:
    def broken(folder: Path, **_: object) -> HiddenEffectRecord:
        folder.mkdir()
        raise ValueError("no such beam")

    record = examine(Case(row="mass", seed=1), tmp_path, NO_GROUPS, make=broken, judge=judge)
    assert record.finding == FAILED
    assert record.failure.startswith("ValueError: no such beam (test_hidden_effects_run.py, line ")
    assert [*tmp_path.iterdir()] == []

    def lost(*_: object, without: tuple[str, ...], **__: object) -> Diagnosis:
        raise ZeroDivisionError(f"without {without}")

    record = examine(Case(row="cubic_excluded", seed=1), tmp_path, NO_GROUPS, make=make, judge=lost)
    assert record.without == ("cubic", "spring")
    assert record.failure.startswith("ZeroDivisionError: without ('cubic', 'spring')")


def test_the_command_scores_what_it_made_and_scores_it_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--only", "nothing", "--nothing", "3", "--workers", "0", "--folder", str(tmp_path)]
    main(options, quick, NO_GROUPS)
    first = capsys.readouterr().out
    assert "a claim in 0 of 3" in first
    text = (tmp_path / "score.md").read_text()
    (tmp_path / "score.md").unlink()
    main([*options, "--score"], groups=NO_GROUPS)
    assert (tmp_path / "score.md").read_text() == text
    assert (tmp_path / "confusion.png").stat().st_size > 1000
    with pytest.raises(SystemExit, match="no record of these campaigns"):
        main([*options, "--first-seed", "1", "--score"], groups=NO_GROUPS)
