"""One round on a small structure: what is hidden is named, what is not is not, and kept steps are not made again."""

import pickle
import re
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import compute_log_density
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.refit import is_poor_fit, shortlist
from diagnosis.threshold.detection_threshold import Thresholds, compute_linear_thresholds
from reduction.joint_law.elastic_stop import ElasticStop
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.joint_law.polynomial_spring import PolynomialSpring
from reduction.joint_law.power_spring import PowerSpring
from tests.slow import slow

EXACT_MODEL = Budget(frequency=0.0, compliance=0.0)
MASS, WHERE = 5e-3, "mass at tip z"  # kg, of 0.8
RATIO, LINE = 1.02, "preload of left"
CUBIC, RATE = "cubic at tip z", 1e6  # N/m^3
#: Kinds that are left out where others compete.
FRICTION = ("dashpot", "air damping", "friction coefficient", "tangential stiffness")
#: What every round does, whatever comes out; refits are of what was shortlisted.
STEPS = ("arrangement", "scores", "ranked scores", "held-out error", "places")


class Kept:
    """Keeps what steps give, as a file would."""

    def __init__(self) -> None:
        self.results: dict[str, bytes] = {}
        self.asked: list[str] = []

    def __call__(self, name: str, make: Callable[[], Any]) -> Any:
        self.asked.append(name)
        if name not in self.results:
            self.results[name] = pickle.dumps(make())
        return pickle.loads(self.results[name])


class Bench:
    """Campaigns of the small structure, and their diagnoses."""

    def __init__(self, small: Model, paper: ModuleType) -> None:
        self.small, self.paper = small, paper
        self.calibration_parameters = list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0})
        self.listed = list_effects(small, level=paper.LEVELS[1])

    def effect(self, name: str) -> Effect:
        return self.listed.effect(name)

    def campaign(self, *hidden: tuple[str, float], seed: int = 5, **changes: Any) -> Any:
        truth = self.small
        for name, value in hidden:
            truth = self.effect(name).apply(truth, [value])
        return self.paper.make_campaign(truth, jitter=3e-5, seed=seed, **changes)

    def diagnose(self, campaign: Any, **options: Any) -> Diagnosis:
        return diagnose(campaign, self.small, self.calibration_parameters, EXACT_MODEL, **options)


@pytest.fixture(scope="module")
def bench(small: Model, paper: ModuleType) -> Bench:
    return Bench(small, paper)


@pytest.fixture(scope="module")
def kept() -> Kept:
    return Kept()


@pytest.fixture(scope="module")
def told() -> list[tuple[str, float]]:
    return []


@pytest.fixture(scope="module")
def heavy(bench: Bench, kept: Kept, told: list[tuple[str, float]]) -> Diagnosis:
    return bench.diagnose(
        bench.campaign((WHERE, MASS)), run_step=kept, report=lambda what, share: told.append((what, share))
    )


def names(of: Diagnosis) -> list[str]:
    return [item.effect.name for item in of.verdict.effects if item.effect is not None]


def test_a_hidden_mass_is_named_with_its_strength(heavy: Diagnosis) -> None:
    assert heavy.verdict.finding is Finding.MISSING
    assert names(heavy) == [WHERE]
    (best,) = heavy.verdict.effects
    assert best is heavy.refits[0]
    # Normal: 4 standard deviations once in 16 000. The interval, 1.3 times that of the draws, is small enough for the
    # test to mean something.
    assert best.strength == pytest.approx(MASS, abs=4 * best.deviation)
    assert best.deviation < 0.04 * MASS
    # The noise of single readings, of 1e-3 in each part.
    assert best.held_out_error < 0.003 < heavy.baseline.held_out_error
    assert heavy.verdict.sentence.startswith(f"M{WHERE[1:]} (0.005")


@slow
def test_one_repeat_of_many_is_enough_to_test_a_claim(bench: Bench) -> None:
    """A weaker mass beside seven repeats: chi^2 of the eighth falls by a seventh of what that of the others does."""
    campaign = bench.campaign((WHERE, 6e-4), n_repeat=8, held=(8,))
    result = bench.diagnose(campaign, without=["density", "spring", "cubic", "gap", "preload", *FRICTION])
    assert WHERE in names(result)
    assert result.refits[0].held_out_gain < 0.25 * result.refits[0].gain


def test_refits_are_ranked_by_both_falls(heavy: Diagnosis) -> None:
    result = [compute_log_density(item) for item in heavy.refits]
    assert result
    assert result == sorted(result, reverse=True)
    for item in heavy.refits:
        assert item.fit.chi2 < heavy.arrangement.fit.chi2
        assert item.held_out_gain < item.gain


def test_scores_are_of_all_candidates_and_limits_of_the_scores(heavy: Diagnosis) -> None:
    assert {score.effect.name for score in heavy.scores} == {item.name for item in heavy.catalogue.candidates}
    assert heavy.thresholds == compute_linear_thresholds(heavy.scores)
    assert heavy.verdict.threshold == heavy.thresholds.gain
    assert {place.name for place in heavy.places} == {"root z", "tip z"}


def left_of(heavy: Diagnosis) -> str:
    best = heavy.verdict.effects[0]
    return f"what is left beside {best.name} of {best.strength:.6g}, limit {heavy.thresholds.gain:.6g}"


def test_steps_have_stable_names(heavy: Diagnosis, kept: Kept) -> None:
    fits = {
        f"fit of {score.effect.name}"
        for score in shortlist(heavy.scores, heavy.arrangement.selection, is_poor=is_poor_fit(heavy.arrangement))
    }
    listed = ", ".join(["nothing", *(item.name for item in heavy.refits)])
    wide = f"intervals beside {heavy.verdict.effects[0].name} of {listed}"
    own = {step for step in kept.asked if " by its own covariance beyond " in step}
    assert {step.partition(" by its")[0] for step in own} == {item.name for item in heavy.refits}
    # The mass moves the resonance by many widths: other starts are sought.
    starts = pickle.loads(kept.results["starts under response control"])
    begun = {
        "starts under response control",
        "branches",
        "other starts",
        f"starts like {heavy.refits[0].name}, round 1",
    } | {f"fit of {effect.name} from start {number}" for number, (effect, _) in enumerate(starts)}
    costs = {name.replace("fit of", "cost of", 1) for name in fits}
    # Where another start led further.
    anew = {step for step in kept.asked if step.startswith("cost of ") and step.endswith(" from another start")}
    assert {step[len("cost of ") : -len(" from another start")] for step in anew} <= {item.name for item, _ in starts}
    # Those that are too far behind are fitted to the end, and not weighed.
    refits = {step for step in kept.asked if step.startswith("refit of ")}
    assert {f"refit of {item.name}" for item in heavy.refits} <= refits
    assert set(kept.asked) == {*STEPS, *fits, *costs, *anew, *refits, *own, *begun, left_of(heavy), wide}
    assert len(kept.asked) == len(set(kept.asked))


def test_a_second_run_computes_nothing(heavy: Diagnosis, kept: Kept, bench: Bench) -> None:
    def stored(name: str, make: Callable[[], Any]) -> Any:
        del make
        return pickle.loads(kept.results[name])

    again = bench.diagnose(bench.campaign((WHERE, MASS)), run_step=stored)
    assert again.verdict.sentence == heavy.verdict.sentence
    for one, other in zip(heavy.refits, again.refits, strict=True):
        np.testing.assert_array_equal(one.fit.values, other.fit.values)


def test_an_interrupted_run_goes_on_where_it_was(heavy: Diagnosis, kept: Kept, bench: Bench) -> None:
    made: list[str] = []

    def after(name: str, make: Callable[[], Any]) -> Any:
        if name in ("places", left_of(heavy)):
            made.append(name)
            return make()
        return pickle.loads(kept.results[name])

    again = bench.diagnose(bench.campaign((WHERE, MASS)), run_step=after)
    assert made == ["places", left_of(heavy)]
    assert again.verdict.sentence == heavy.verdict.sentence


def test_progress_rises_from_nothing_to_all(heavy: Diagnosis, told: list[tuple[str, float]]) -> None:
    assert heavy is not None
    what, share = zip(*told, strict=True)
    assert share[0] == 0.0
    assert share[-1] == 1.0
    assert (np.diff(share) >= 0).all()
    assert what[0] == "calibration"
    assert f"fit of {WHERE}" in what


@slow
def test_without_its_kind_it_is_not_that_kind(bench: Bench) -> None:
    result = bench.diagnose(bench.campaign((WHERE, MASS)), without=["mass", "density"])
    kinds = {item.kind for item in result.catalogue.candidates}
    assert "mass" not in kinds
    assert "density" not in kinds
    assert all(name.split(" ")[0] not in ("mass", "density") for name in names(result))
    assert result.verdict.finding is not Finding.NOTHING
    # Near which place is told without any catalogue.
    assert result.places[0].name == "tip z"


@slow
def test_without_all_that_looks_like_it_something_unknown_is_missing(bench: Bench) -> None:
    result = bench.diagnose(bench.campaign((CUBIC, RATE)), without=["cubic", "air damping"])
    assert result.verdict.finding is Finding.UNKNOWN
    assert names(result) == []
    place = result.verdict.place
    assert place is not None
    # Straight on the linear side: a force against the displacement.
    assert abs(place.phase) == pytest.approx(180, abs=15)


@slow
def test_a_spring_of_another_power_is_no_cubic_one(bench: Bench, paper: ModuleType) -> None:
    row = bench.small.places["tip z"]
    fifth = PowerSpring(name="hidden", direction=row, stiffness=300.0, reference=1e-2, exponent=5.0)
    truth = bench.small.with_system(joints=[*bench.small.system.joints, fifth])
    result = bench.diagnose(paper.make_campaign(truth, jitter=3e-5, seed=5))
    assert result.verdict.finding is Finding.UNKNOWN
    assert "to the power 5" in result.verdict.sentence


@slow
def test_a_play_is_no_cubic_spring(bench: Bench, paper: ModuleType) -> None:
    row = bench.small.places["tip z"]
    play = [ElasticStop(name=f"hidden {side}", direction=side * row, stiffness=500.0, gap=1e-3) for side in (1.0, -1.0)]
    truth = bench.small.with_system(joints=[*bench.small.system.joints, *play])
    verdict = bench.diagnose(paper.make_campaign(truth, jitter=3e-5, seed=5)).verdict
    assert verdict.finding is Finding.UNKNOWN
    pattern = r"a spring of (\S+) \+- (\S+) N/m beyond a clearance of (\S+) \+- (\S+) um on either side"
    said = re.search(pattern, verdict.sentence)
    assert said is not None
    stiffness, of_stiffness, gap, of_gap = map(float, said.groups())
    # Twice the interval of 95 %: a normal deviation exceeds that in one case of 10,000.
    assert abs(stiffness - 500.0) < 2 * of_stiffness < 10.0
    assert abs(gap - 1000.0) < 2 * of_gap < 100.0


@slow
def test_a_spring_that_is_stiffer_on_one_side_is_told_beside_a_softening_one(bench: Bench, paper: ModuleType) -> None:
    """The fundamental hardly tells them apart."""
    bent = PolynomialSpring(name="hidden", direction=bench.small.places["tip z"], quadratic=1.5e5)
    truth = bench.small.with_system(joints=[*bench.small.system.joints, bent])
    verdict = bench.diagnose(paper.make_campaign(truth, jitter=3e-5, seed=5)).verdict
    assert verdict.finding is Finding.AMBIGUOUS
    said = re.search(r"a force with the square of the displacement, (\S+) \+- (\S+) N/m\^2", verdict.sentence)
    assert said is not None
    factor, of_factor = map(float, said.groups())
    assert abs(factor - 1.5e5) < 2 * of_factor < 1e4


def test_where_nothing_is_hidden_nothing_is_claimed(bench: Bench) -> None:
    result = bench.diagnose(bench.campaign(seed=6))
    assert result.verdict.finding is Finding.NOTHING
    assert names(result) == []
    smallest = result.verdict.detectable[WHERE]
    # What it would have taken is far below what the other tests hide, and is told.
    assert 0 < smallest < 0.1 * MASS
    assert f"{WHERE} {smallest:.2g} kg" in result.verdict.smallest


def test_in_a_model_that_is_another_structure_no_effect_is_tried(bench: Bench) -> None:
    """Its springs are 36 % softer, and so its resonances 20 % lower: a mass or a spring would mend the first alone."""
    joints = [
        joint.with_values({name: 0.64 * getattr(joint, name) for name in ("normal_stiffness", "tangential_stiffness")})
        for joint in list_friction_contacts(bench.small.system.joints)
    ]
    softer = bench.small.with_system(stiffness=0.64 * bench.small.system.stiffness, joints=joints)
    result = diagnose(bench.campaign(), softer, bench.calibration_parameters, EXACT_MODEL)
    assert result.verdict.finding is Finding.NOT_CLOSE
    assert "resonance near" in result.verdict.sentence
    assert result.scores == result.refits == ()


def test_what_was_added_is_fitted_again_with_what_comes_next(bench: Bench) -> None:
    start = 4.2e-3
    result = bench.diagnose(
        bench.campaign((WHERE, MASS), (LINE, RATIO)),
        added=[AddedEffect(effect=bench.effect(WHERE), values=np.array([start]))],
        without=["cubic", "gap", "dashpot", "air damping"],
    )
    assert result.verdict.finding is Finding.MISSING
    assert names(result) == [LINE]
    (best,) = result.verdict.effects
    fit = best.fit
    assert fit.unknowns.names == ("kt", "mu", "zeta", WHERE, LINE)
    # It has no prior, and comes to its true value with the calibration parameters and the new effect.
    assert np.isinf(fit.unknowns.prior[3])
    assert result.arrangement.fit.values[3] != start
    for number, true in ((3, MASS), (4, RATIO)):
        assert fit.values[number] == pytest.approx(true, abs=4 * fit.deviation[number])
    assert (best.strength, best.deviation) == (fit.values[4], fit.deviation[4])
    # The base stays the engineer's own model.
    np.testing.assert_array_equal(result.arrangement.base.system.stiffness, bench.small.system.stiffness)
    assert [item.name for item in result.arrangement.added] == [WHERE]
    # What is there already is no candidate.
    assert WHERE not in [score.effect.name for score in result.scores]


@slow
def test_a_round_after_all_was_added_finds_nothing(bench: Bench) -> None:
    added = [AddedEffect(effect=bench.effect(WHERE), values=np.array([0.9 * MASS]))]
    result = bench.diagnose(bench.campaign((WHERE, MASS)), added=added)
    assert result.verdict.finding is Finding.NOTHING
    assert result.baseline.fit.values[3] == pytest.approx(MASS, abs=4 * result.baseline.fit.deviation[3])


def test_limits_that_are_given_judge(bench: Bench, kept: Kept, heavy: Diagnosis) -> None:
    assert heavy is not None

    def stored(name: str, make: Callable[[], Any]) -> Any:
        return pickle.loads(kept.results[name]) if name in kept.results else make()

    enormous = Thresholds(gain=1e9, misfit=1e9)
    result = bench.diagnose(bench.campaign((WHERE, MASS)), thresholds=enormous, run_step=stored)
    assert result.thresholds is enormous
    assert result.verdict.finding is Finding.NOTHING
    unknown = bench.diagnose(
        bench.campaign((WHERE, MASS)), thresholds=Thresholds(gain=1e9, misfit=100.0), run_step=stored
    )
    assert unknown.verdict.finding is Finding.UNKNOWN
    assert unknown.verdict.place is not None
    assert unknown.verdict.place.name == "tip z"


def test_nothing_held_out_is_refused(bench: Bench) -> None:
    with pytest.raises(CampaignError, match="nothing is held out"):
        bench.diagnose(bench.campaign(held=()))


def test_an_effect_where_no_place_is_is_named_if_those_at_the_places_explain_less(bench: Bench) -> None:
    lacking = replace(bench.small, places={name: row for name, row in bench.small.places.items() if name != "tip z"})
    # A density or a spring would do the same to a single mode.
    without = ("density", "spring", *FRICTION)
    campaign, accepted = bench.campaign((WHERE, 4 * MASS)), bench.calibration_parameters
    result = diagnose(campaign, lacking, accepted, EXACT_MODEL, without=without)
    assert names(result)[0] == "mass at node 1 z"
    assert result.verdict.effects[0].strength == pytest.approx(4 * MASS, abs=4 * result.verdict.effects[0].deviation)
    assert "mass at node 1 z" in [score.effect.name for score in result.scores]
