"""From hand-made refits to a verdict: each rule alone turns it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.candidate.effect import EffectParameter
from diagnosis.decision import pair_search
from diagnosis.decision.evidence import CREDIBLE, DECISIVE, compute_log_density, passes
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.pair import Pair
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.decision.rules import Criteria, decide, find_untestable
from diagnosis.decision.stand_in import MAX_SHARE_LEFT, MIN_SHARE_KNOWN
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.localisation import UnknownForcePlace
from diagnosis.screening import Score
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import compute_excess_gain

#: Numbers held out, chi^2 of both sets before anything is added.
N_TRAIN, N_HELD, CHI2, HELD_CHI2 = 1000, 500, 900.0, 400.0
LIMITS = Thresholds(gain=20.0, misfit=30.0)


NO_EFFECT = ResidualExplanation(gain=0.0, effect_name="", places=(), known_effect_gain=0.0)


def refit(name: str, fall: float, held_fall: float, n_number: int = 1000, strength: float = 1.0) -> Refit:
    def apply(model: Any, values: list[float]) -> Any:
        """As kinds do: a spring of a law of its own changes the joints, a mass does not."""
        del values
        return SimpleNamespace(system=SimpleNamespace(joints=[])) if name.startswith("cubic") else model

    parameter = SimpleNamespace(unit="kg", typical=1.0, vanishes=0.0)
    kind = name.partition(" ")[0]
    effect: Any = SimpleNamespace(name=name, kind=kind, parameters=(parameter,), apply=apply) if name else None
    unknowns: Any = Unknowns(
        base=SimpleNamespace(), effects=(effect or SimpleNamespace(name=name, parameters=(parameter,)),),
        prior=np.full(1, np.inf),
    )  # fmt: skip
    fit: Any = SimpleNamespace(
        chi2=CHI2 - fall, n_number=n_number, values=np.array([strength]), unknowns=unknowns, deviation=np.ones(1),
        is_beyond_priors=False,
    )  # fmt: skip
    held = (HELD_CHI2 - held_fall) / N_HELD
    return Refit(
        effect=effect,
        fit=fit,
        held_out_reduced_chi2=held,
        n_held_out=N_HELD,
        error=0.1,
        held_out_error=0.1,
        gain=fall,
        held_out_gain=held_fall,
    )


BEFORE = refit("", 0.0, 0.0)


def place(fall: float, n_number: int = 6) -> UnknownForcePlace:
    return UnknownForcePlace(
        name="tip", gain=fall, n_number=n_number, level=np.ones(1), amplitude=np.ones(1), stiffness=np.ones(1, complex),
        deviation=np.ones(1),
        third=np.zeros(2, complex), exponent=1.0, exponent_deviation=0.1, phase=0.0, configuration="free",
    )  # fmt: skip


def decided(
    *refits: Refit,
    places: tuple[UnknownForcePlace, ...] = (),
    rest: ResidualExplanation = NO_EFFECT,
    asked: list[str] | None = None,
    scores: tuple[Score, ...] = (),
    baseline: Refit = BEFORE,
    left: ErrorSize = NO_ERROR,
    beside: ErrorSize | None = None,
    laws: Sequence[FittedLaw] = (),
    beyond_priors: Sequence[str] = (),
    pair: Pair | None = None,
    own_law: FittedLaw | None = None,
    laws_of: Callable[[str], Sequence[FittedLaw]] | None = None,
    seconds: Sequence[Finalist] = (),
) -> Verdict:
    def run_step(name: str, make: Callable[[], Any]) -> Any:
        del make  # the catalogue and the model of these refits are nothing that could be computed with
        if asked is not None:
            asked.append(name)
        if name.endswith("together"):
            return pair
        if " with others than " in name:
            assert pair is not None
            return [pair.second, *seconds]
        if name.endswith("by its own covariance"):
            return own_law
        if name.startswith("other laws"):
            return list(laws if laws_of is None else laws_of(name))
        return rest

    model = SimpleNamespace(system=SimpleNamespace(joints=[object()]))
    size = left if beside is None else beside
    arrangement = SimpleNamespace(model_error_size=size, fit=SimpleNamespace(model=model), finer=())
    ranked: list[Any] = [
        SimpleNamespace(name=item.name, refit=item, arrangement=arrangement)
        for item in sorted(refits, key=lambda item: -compute_log_density(item))
    ]
    catalogue: Any = SimpleNamespace(candidates=())
    refit_one: Any = None if own_law is None else object()
    criteria = Criteria(catalogue=catalogue, scores=scores, thresholds=LIMITS, refit_by_own_covariance=refit_one)
    return decide(criteria, baseline, ranked, places, run_step, left, beyond_priors)


def named(verdict: Verdict) -> list[str]:
    return [item.effect.name for item in verdict.effects if item.effect is not None]


def test_one_effect_that_explains_is_missing() -> None:
    verdict = decided(refit("mass", 100, 80), refit("spring", 10, 5), places=(place(90),))
    assert verdict.finding is Finding.MISSING
    assert named(verdict) == ["mass"]
    assert verdict.threshold == LIMITS.gain
    assert verdict.baseline is BEFORE


@pytest.mark.parametrize(
    ("fall", "held_fall", "finding"),
    [
        (LIMITS.gain + 1, 100, Finding.MISSING),
        (LIMITS.gain - 1, 100, Finding.NOTHING),  # no more than chance, however well the held-out data follow
        (LIMITS.gain, 100, Finding.NOTHING),
        (100, DECISIVE + 1e-6, Finding.MISSING),
        (100, DECISIVE - 1e-6, Finding.AMBIGUOUS),  # held-out data that do not confirm it
        (100, 1e-6 - DECISIVE, Finding.AMBIGUOUS),  # ... or do not see it
        (100, -DECISIVE, Finding.NOTHING),  # fits what the held-out data do not have
        (LIMITS.gain + 1, -0.9, Finding.AMBIGUOUS),
        (LIMITS.gain + 1, -1.1, Finding.NOTHING),  # what they lose is more than what is beyond chance
        (100, -50, Finding.NOTHING),
        (-5, 100, Finding.NOTHING),
    ],
)
def test_a_claim_needs_the_limit_and_the_held_out_data(fall: float, held_fall: float, finding: Finding) -> None:
    one = refit("mass", fall, held_fall)
    assert passes(one, LIMITS) is (finding is not Finding.NOTHING)
    assert decided(one).finding is finding


def test_a_model_that_is_far_off_is_not_diagnosed() -> None:
    far = ErrorSize(reading=0.3)
    verdict = decided(left=far)
    assert verdict.finding is Finding.NOT_CLOSE
    assert "30 % in the readings" in verdict.sentence
    # An effect beside which the model is still far off is not what is missing.
    assert decided(refit("mass", 100, 80), left=far).finding is Finding.NOT_CLOSE


FAR = ErrorSize(damping=0.65)


@pytest.mark.parametrize(
    ("one", "beside", "finding"),
    [
        (refit("mass", 8, 7), NO_ERROR, Finding.AMBIGUOUS),
        (refit("mass", 8, 7), FAR, Finding.NOT_CLOSE),
        (refit("mass", 8, DECISIVE - 1e-6), NO_ERROR, Finding.NOT_CLOSE),
        (refit("mass", -1, 7), NO_ERROR, Finding.NOT_CLOSE),
        (replace(refit("mass", 8, 7), worsens=True), NO_ERROR, Finding.NOT_CLOSE),
        (replace(refit("mass", 8, 7), reduced_chi2_without_model_error=2.1), NO_ERROR, Finding.NOT_CLOSE),
        (replace(refit("mass", 8, 7), held_out_reduced_chi2_without_model_error=2.1), NO_ERROR, Finding.NOT_CLOSE),
    ],
)
def test_an_effect_may_take_the_place_of_an_error_that_no_sound_model_has(
    one: Refit, beside: ErrorSize, finding: Finding
) -> None:
    verdict = decided(one, refit("spring", 1, -2), left=FAR, beside=beside)
    assert verdict.finding is finding
    assert named(verdict) == (["mass"] if finding is Finding.AMBIGUOUS else [])
    assert verdict.replaces_error is (finding is Finding.AMBIGUOUS)
    several = decided(one, replace(one, effect=refit("spring", 1, 1).effect), left=FAR, beside=beside)
    assert ("or a model error resembles one of them" in several.sentence) is several.replaces_error


@pytest.mark.parametrize(
    ("detectable", "is_seen", "words"),
    [
        ({"mass": 0.1}, True, ""),
        ({"mass": 0.1, "spring": np.inf}, False, "no motion exceeds"),
        ({"mass": np.inf}, True, "at any strength"),
    ],
)
def test_where_no_effect_would_show_nothing_is_no_answer(
    detectable: dict[str, float], is_seen: bool, words: str
) -> None:
    verdict = find_untestable(replace(decided(), detectable=detectable), is_seen)
    assert verdict.finding is (Finding.NOT_TESTABLE if words else Finding.NOTHING)
    assert words in verdict.sentence
    # What is found is found, and readings of noise are not far off.
    missing = replace(decided(refit("mass", 100, 80)), detectable=detectable)
    assert find_untestable(missing, is_seen) is missing
    far = find_untestable(replace(decided(left=ErrorSize(reading=0.3)), detectable=detectable), is_seen)
    assert far.finding is (Finding.NOT_CLOSE if is_seen else Finding.NOT_TESTABLE)
    # Nor has noise taken a parameter to the end of its prior for a reason that a user could correct.
    beyond_priors = find_untestable(replace(decided(beyond_priors=["zeta x 2"]), detectable=detectable), is_seen)
    assert beyond_priors.finding is (Finding.UNKNOWN if is_seen else Finding.NOT_TESTABLE)
    assert bool(beyond_priors.beyond_priors) == is_seen


def test_no_candidate_means_nothing_or_something_unknown() -> None:
    assert decided().finding is Finding.NOTHING
    assert named(decided()) == []
    assert decided(places=(place(LIMITS.misfit + 7),)).finding is Finding.UNKNOWN


@pytest.mark.parametrize(
    ("error", "stated", "finding"),
    [(0.17, 9.0, Finding.UNKNOWN), (0.17, 1.1, Finding.NOTHING), (0.05, 9.0, Finding.NOTHING)],
)
def test_what_the_held_out_data_alone_show_is_not_nothing(error: float, stated: float, finding: Finding) -> None:
    """A stop that is reached at the highest level alone; but noise may be as large."""
    baseline = replace(BEFORE, held_out_error=error, error=0.03, held_out_reduced_chi2_without_model_error=stated)
    verdict = decided(baseline=baseline)
    assert verdict.finding is finding
    assert ("17 % there and 3 % on the training data" in verdict.sentence) is (finding is Finding.UNKNOWN)


@pytest.mark.parametrize(("stated", "alone"), [(1.1, True), (4680.0, False)])
def test_held_out_data_show_it_alone_only_where_the_others_are_explained(stated: float, alone: bool) -> None:
    baseline = replace(
        BEFORE, held_out_error=0.41, error=0.41 if not alone else 0.03, held_out_reduced_chi2_without_model_error=9.0
    )
    verdict = decided(baseline=replace(baseline, reduced_chi2_without_model_error=stated))
    assert verdict.finding is Finding.UNKNOWN
    assert ("only the held-out data show" in verdict.sentence) is alone
    assert "41 %" in verdict.sentence


#: Fall of chi^2 behind the best at which one of two effects has the probability `CREDIBLE`.
BEHIND = 2 * np.log(CREDIBLE / (1 - CREDIBLE))


@pytest.mark.parametrize(("behind", "finding"), [(BEHIND - 0.5, Finding.AMBIGUOUS), (BEHIND + 0.5, Finding.MISSING)])
def test_two_that_explain_alike_cannot_be_told(behind: float, finding: Finding) -> None:
    """What counts is both falls together: one gains more in training, the other in the held-out data."""
    best, other = refit("mass", 90, 70), refit("density", 100, 60 - behind)
    verdict = decided(best, other)
    assert verdict.finding is finding
    assert named(verdict) == (["mass", "density"] if finding is Finding.AMBIGUOUS else ["mass"])
    assert verdict.probabilities[0] == pytest.approx(1 / (1 + np.exp(-behind / 2)))


def test_many_that_explain_a_little_worse_are_named_until_their_probability_is_credible() -> None:
    """Each is 8 behind, which is one in 55: ten of them leave the best 85 %, and with seven of them there are 95 %."""
    verdict = decided(refit("mass", 90, 70), *(refit(f"spring {number}", 90, 62) for number in range(10)))
    assert verdict.finding is Finding.AMBIGUOUS
    assert sum(verdict.probabilities) >= CREDIBLE > sum(verdict.probabilities[:-1])
    assert verdict.probabilities[0] == pytest.approx(1 / (1 + 10 * np.exp(-4)))


def test_an_effect_that_leaves_next_to_nothing_is_no_stand_in() -> None:
    """Model error as large as the responses explains much without it, so that its gain is small beside what is left."""
    rest = ResidualExplanation(gain=0.0, effect_name="", places=(place(LIMITS.misfit + 50),), known_effect_gain=0.0)
    cubic, lost = (
        replace(refit("cubic", 90, 70), reduced_chi2_without_model_error=5.0),
        replace(BEFORE, reduced_chi2_without_model_error=7000.0),
    )
    assert decided(cubic, rest=rest).finding is Finding.UNKNOWN
    assert decided(cubic, rest=rest, baseline=lost).finding is Finding.MISSING
    assert (
        decided(cubic, rest=rest, baseline=replace(BEFORE, reduced_chi2_without_model_error=50.0)).finding
        is Finding.UNKNOWN
    )


def test_what_the_held_out_data_do_not_refute_stays_a_rival() -> None:
    """A fall of -2 ln p by 2 the wrong way is chance; one of 50 is not. The more probable effect comes first."""
    for gain, names in ((141, ["mass", "gap"]), (145, ["gap", "mass"])):
        verdict = decided(refit("mass", 100, 40), refit("gap", gain, -2))
        assert verdict.finding is Finding.AMBIGUOUS
        assert named(verdict) == names
    assert named(decided(refit("mass", 100, 40), refit("gap", 190, -50))) == ["mass"]
    worse = replace(refit("gap", 145, 2), worsens=True)
    assert named(decided(refit("mass", 100, 40), worse)) == ["mass"]
    assert decided(worse).finding is Finding.NOTHING


@pytest.mark.parametrize(
    ("left", "n_number", "unknown"),
    [
        (MAX_SHARE_LEFT * 200 + LIMITS.misfit + 7, 6, True),
        (MAX_SHARE_LEFT * 200 + LIMITS.misfit + 5, 6, False),  # beyond its six numbers it is less than the share
        (MAX_SHARE_LEFT * 200 + LIMITS.misfit + 7, 8, False),
    ],
)
def test_an_unknown_force_that_is_left_makes_the_best_effect_a_stand_in(
    left: float, n_number: int, unknown: bool
) -> None:
    rest = ResidualExplanation(gain=0.0, effect_name="", places=(place(left, n_number),), known_effect_gain=left)
    there = place(300)
    verdict = decided(refit("mass", 200, 150), places=(there,), rest=rest)
    assert verdict.finding is (Finding.UNKNOWN if unknown else Finding.MISSING)
    if unknown:
        # Where it is, is told from what the model lacks, not from what the stand-in leaves.
        assert verdict.place is there
        assert named(verdict) == []
        assert "mass comes nearest" in verdict.sentence


@pytest.mark.parametrize(
    ("left", "unknown"),
    [(MAX_SHARE_LEFT * 200 + LIMITS.gain + 1, True), (MAX_SHARE_LEFT * 200 + LIMITS.gain - 1, False)],
)
def test_a_further_effect_that_is_left_makes_it_a_stand_in_too(left: float, unknown: bool) -> None:
    verdict = decided(
        refit("mass", 200, 150),
        rest=ResidualExplanation(gain=left, effect_name="gap", places=(), known_effect_gain=left),
    )
    assert verdict.finding is (Finding.UNKNOWN if unknown else Finding.MISSING)
    if unknown:
        assert "no known effect alone explains it: mass explains most, and gap much" in verdict.sentence


def beside(further: Refit, *first: Refit, force: float = 0.0) -> dict[str, Any]:
    """What is left by the first effect, and fits of it, or of others in its place, with a further one."""
    arrangement: Any = SimpleNamespace(model_error_size=NO_ERROR)
    both = [Finalist(refit=item, arrangement=arrangement) for item in (*first, further)]
    rest = ResidualExplanation(gain=150, effect_name=further.name, places=(), known_effect_gain=150, refit=further)
    pair = Pair(first=both[0], second=both[-1], alone=both[-1], alternatives=tuple(both[1:-1]), force=force)
    return {"rest": rest, "pair": pair}


@pytest.mark.parametrize(("held", "finding"), [(DECISIVE - 1, Finding.MISSING), (DECISIVE - 3, Finding.AMBIGUOUS)])
def test_held_out_data_confirm_two_effects_together(held: float, finding: Finding) -> None:
    first, further = refit("mass", 400, 50, strength=2.0), refit("gap", 150, held)
    verdict = decided(refit("mass", 200, 2), **beside(further, first))
    assert verdict.finding is finding
    assert verdict.further is further
    # Its strength is that of the fit with both.
    assert [*verdict.effects] == [first]
    assert "and gap (1 kg +- 2) are missing" in verdict.sentence


def test_what_is_as_likely_beside_the_further_effect_is_named_too() -> None:
    """The density is nearly as probable beside the gap; where it is refuted there, it is not named."""
    further, alone = refit("gap", 150, 50), [refit("mass", 200, 20), refit("density", 150, 20)]
    for gain, names in ((399, ["mass", "density"]), (380, ["mass"])):
        verdict = decided(*alone, **beside(further, refit("mass", 400, 50), refit("density", gain, 50)))
        assert named(verdict) == names
        assert verdict.finding is (Finding.MISSING if len(names) == 1 else Finding.AMBIGUOUS)
    worse = replace(refit("density", 399, 50), worsens=True)
    assert named(decided(*alone, **beside(further, refit("mass", 400, 50), worse))) == ["mass"]


def test_what_is_more_likely_beside_the_further_effect_is_fitted_as_the_first() -> None:
    further, alone = refit("gap", 150, 50), [refit("mass", 200, 20), refit("density", 150, 20)]
    asked: list[str] = []
    pairs = beside(further, refit("mass", 400, 50), refit("density", 420, 50))
    decided(*alone, asked=asked, **pairs)
    assert [name.partition(" and")[0] for name in asked if name.endswith("together")] == ["mass", "density"]


def finalist(item: Refit) -> Finalist:
    arrangement: Any = SimpleNamespace(model_error_size=NO_ERROR)
    return Finalist(refit=item, arrangement=arrangement)


@pytest.mark.parametrize(("behind", "doubtful"), [(1.0, True), (3 * DECISIVE, False)])
def test_what_is_as_likely_in_place_of_the_second_effect_is_told(behind: float, doubtful: bool) -> None:
    pair = beside(refit("gap", 150, 50), refit("mass", 400, 50))
    others = [finalist(refit("spring", 150 - behind, 50)), finalist(refit("spring at base", LIMITS.gain - 1, 50))]
    verdict = decided(refit("mass", 200, 20), **pair, seconds=others)
    assert verdict.finding is (Finding.AMBIGUOUS if doubtful else Finding.MISSING)
    assert [item.name for item in verdict.further_alternatives] == (["spring"] if doubtful else [])
    told = "Mass (1 kg +- 2) is missing, and also gap (1 kg +- 2) or spring (1 kg +- 2), and these data cannot tell"
    assert verdict.sentence.startswith(told) is doubtful


def test_what_is_more_likely_in_place_of_the_second_effect_is_fitted_as_the_second() -> None:
    asked: list[str] = []
    pair = beside(refit("gap", 150, 50), refit("mass", 400, 50))
    decided(refit("mass", 200, 20), asked=asked, **pair, seconds=[finalist(refit("spring", 160, 50))])
    pairs = [name.partition(" of ")[0] for name in asked if name.endswith("together")]
    assert pairs == ["mass and gap", "mass and spring"]


def test_a_second_effect_that_ends_better_when_it_starts_again_is_fitted_with_the_first_again() -> None:
    asked: list[str] = []
    pair = beside(refit("gap", 150, 50), refit("mass", 400, 50))
    again = finalist(refit("gap", 170, 50, strength=2.0))
    verdict = decided(refit("mass", 200, 20), asked=asked, **pair, seconds=[again])
    pairs = [name for name in asked if name.endswith("together")]
    assert pairs == ["mass and gap of 1 and 1 together", "mass and gap of 1 and 2 together"]
    assert not verdict.further_alternatives


def test_another_second_effect_at_the_place_of_the_first_is_not_fitted() -> None:
    pair = beside(refit("gap", 150, 50), refit("mass at tip", 400, 50))
    verdict = decided(refit("mass at tip", 200, 20), **pair, seconds=[finalist(refit("spring at tip", 200, 50))])
    assert verdict.further is not None
    assert verdict.further.name == "gap"
    assert not verdict.further_alternatives


@pytest.mark.parametrize(("behind", "finding"), [(DECISIVE - 1, Finding.AMBIGUOUS), (DECISIVE + 1, Finding.UNKNOWN)])
def test_two_effects_at_one_place_are_one_force(behind: float, finding: Finding) -> None:
    """Unless the first one is as likely at another place."""
    further, alone = refit("gap at tip", 150, 50), [refit("mass at tip", 200, 20), refit("mass at root", 150, 20)]
    pairs = beside(further, refit("mass at tip", 400, 50), refit("mass at root", 400 - behind, 50))
    verdict = decided(*alone, **pairs)
    assert verdict.finding is finding
    assert "mass at tip" not in named(verdict) or finding is Finding.AMBIGUOUS
    assert decided(alone[0], **beside(further, refit("mass at tip", 400, 50))).finding is Finding.UNKNOWN


@pytest.mark.parametrize(
    ("force", "finding"),
    [
        (MAX_SHARE_LEFT * 350 + LIMITS.misfit - 1, Finding.MISSING),
        (MAX_SHARE_LEFT * 350 + LIMITS.misfit + 1, Finding.UNKNOWN),
    ],
)
def test_two_effects_leave_no_unknown_force(force: float, finding: Finding) -> None:
    pair = beside(refit("gap", 150, 50), refit("mass", 400, 50), force=force)
    assert decided(refit("mass", 200, 20), **pair).finding is finding


@pytest.mark.parametrize(
    ("error", "beyond_priors", "finding"),
    [(0.2, ("mu x 0.6",), Finding.UNKNOWN), (0.2, (), Finding.MISSING), (0.05, ("mu x 0.6",), Finding.MISSING)],
)
def test_two_effects_that_leave_a_large_error_and_strained_parameters_are_not_named(
    error: float, beyond_priors: tuple[str, ...], finding: Finding, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pair_search, "list_beyond_priors", lambda _: beyond_priors)
    further = replace(refit("gap", 150, 50), held_out_error=error, held_out_reduced_chi2=UNEXPLAINED_CHI2 + 1)
    before = replace(BEFORE, held_out_error=0.5, held_out_reduced_chi2=10.0)
    verdict = decided(refit("mass", 200, 20), **beside(further, refit("mass", 400, 50)), baseline=before)
    assert verdict.finding is finding


@pytest.mark.parametrize(("gain", "finding"), [(LIMITS.gain + 1, Finding.MISSING), (LIMITS.gain - 1, Finding.UNKNOWN)])
def test_an_effect_that_explains_nothing_beside_the_further_one_is_not_missing(gain: float, finding: Finding) -> None:
    """It stood in for that one, which is to be judged alone."""
    pair = beside(refit("gap", 150, 50), refit("mass", gain, 50))
    verdict = decided(refit("mass", 200, 20), **pair)
    assert verdict.finding is finding
    assert verdict.instead is (pair["pair"].alone if finding is Finding.UNKNOWN else None)


@pytest.mark.parametrize(("held", "finding"), [(40, Finding.AMBIGUOUS), (DECISIVE + 9, Finding.NOTHING)])
def test_two_effects_of_which_the_held_out_data_refute_each_alone(held: float, finding: Finding) -> None:
    pair = beside(refit("gap", 150, held), refit("mass", 400, 50))
    verdict = decided(refit("mass", 200, -10), **pair)
    assert verdict.finding is finding
    assert named(verdict) == (["mass"] if finding is Finding.AMBIGUOUS else [])


@pytest.mark.parametrize(
    ("misfit_after", "error_after", "finding"),
    [
        (1.5, 0.09, Finding.MISSING),
        (2.1, 0.09, Finding.AMBIGUOUS),  # by noise they are further off
        (1.5, 0.11, Finding.AMBIGUOUS),
        (0.9, 0.11, Finding.MISSING),  # noise explains the error
    ],
)
def test_held_out_data_confirm_nothing_that_makes_them_worse(
    misfit_after: float, error_after: float, finding: Finding
) -> None:
    baseline = replace(BEFORE, held_out_reduced_chi2_without_model_error=2.0)
    better = replace(
        refit("mass", 100, 50), held_out_reduced_chi2_without_model_error=misfit_after, held_out_error=error_after
    )
    assert decided(better, baseline=baseline).finding is finding
    good = replace(refit("mass", 100, 50), held_out_reduced_chi2_without_model_error=1.5, held_out_error=0.08)
    # Nor two effects of which the first does so alone, or both do together.
    for first, other in ((good, better), (better, good)):
        further = replace(
            refit("gap", 150, 60),
            held_out_reduced_chi2_without_model_error=other.held_out_reduced_chi2_without_model_error,
            held_out_error=other.held_out_error,
        )
        both = replace(further, effect=first.effect, gain=400)
        assert decided(first, baseline=baseline, **beside(further, both)).finding is finding


@pytest.mark.parametrize(("name", "finding"), [("mass", Finding.AMBIGUOUS), ("cubic", Finding.MISSING)])
def test_what_takes_mass_away_is_named_with_doubt(name: str, finding: Finding) -> None:
    """A model errs like that; a force that softens does not."""
    assert decided(refit(f"{name} at tip", 100, 80)).finding is Finding.MISSING
    verdict = decided(refit(f"{name} at tip", 100, 80, strength=-1.0))
    assert verdict.finding is finding


def test_what_needs_a_parameter_at_the_end_of_its_prior_is_named_with_doubt() -> None:
    result = refit("density of all", 100, 80)
    modulus = EffectParameter(name="factor", unit="-", lower=0.95, upper=1.05, typical=1.01, vanishes=1.0)
    for value, finding in ((1.02, Finding.MISSING), (1.05, Finding.AMBIGUOUS)):
        effects = tuple(SimpleNamespace(name=name, parameters=(modulus,)) for name in ("E", "density"))
        unknowns = Unknowns(base=SimpleNamespace(), effects=effects, prior=np.array([0.01, np.inf]))
        fit: Any = SimpleNamespace(**{**vars(result.fit), "unknowns": unknowns, "values": np.array([value, 0.96])})
        assert decided(replace(result, fit=fit)).finding is finding


def test_what_chance_leaves_makes_no_stand_in() -> None:
    """A weak effect explains 25; others may leave more than a third of it by chance, up to the limits."""
    weak = refit("mass", 25, 20)
    chance = ResidualExplanation(
        gain=LIMITS.gain - 1, effect_name="gap", places=(place(LIMITS.misfit + 5),), known_effect_gain=0.0
    )
    assert chance.gain > MAX_SHARE_LEFT * 25
    assert decided(weak, rest=chance).finding is Finding.MISSING
    beyond = ResidualExplanation(
        gain=MAX_SHARE_LEFT * 25 + LIMITS.gain + 1, effect_name="gap", places=(), known_effect_gain=0.0
    )
    assert decided(weak, rest=beyond).finding is Finding.UNKNOWN


@pytest.mark.parametrize(
    ("name", "more", "known", "stated", "unknown"),
    [
        ("mass", 8, MIN_SHARE_KNOWN - 0.01, 9.0, True),
        ("mass", 8, MIN_SHARE_KNOWN + 0.01, 9.0, False),  # the next effect to be named
        ("mass", 4, 0.0, 9.0, False),  # chance, beyond its six numbers
        ("mass", 8, 0.0, 1.5, False),  # noise explains all that is left
        ("cubic", 8, 0.0, 9.0, False),  # the nearest of the known laws
    ],
)
def test_a_linear_effect_that_leaves_a_force_of_no_known_effect_stands_in_however_much_it_gains(
    name: str, more: float, known: float, stated: float, unknown: bool
) -> None:
    """Where a frequency is 5 % off, as a slider's is that sticks at low levels, what mends that gains thousands."""
    left = LIMITS.misfit + more
    rest = ResidualExplanation(gain=0.0, effect_name="gap", places=(place(left),), known_effect_gain=known * left)
    assert left < MAX_SHARE_LEFT * 10000
    verdict = decided(replace(refit(name, 10000, 50), reduced_chi2_without_model_error=stated), rest=rest)
    assert verdict.finding is (Finding.UNKNOWN if unknown else Finding.MISSING)
    if unknown:
        assert "mass explains most, and a residual remains: near tip" in verdict.sentence


@pytest.mark.parametrize(("more", "finding"), [(1, Finding.UNKNOWN), (-1, Finding.NOTHING)])
def test_an_unknown_force_beyond_chance_is_told_when_nothing_known_passes(more: float, finding: Finding) -> None:
    there = place(LIMITS.misfit + 6 + more)
    assert compute_excess_gain(there) == LIMITS.misfit + more
    weak = refit("mass", LIMITS.gain - 5, 10)
    verdict = decided(weak, places=(there, place(1)))
    assert verdict.finding is finding
    assert verdict.place is (there if finding is Finding.UNKNOWN else None)


def test_a_parameter_that_its_prior_holds_back_leaves_nothing_to_name() -> None:
    there = place(LIMITS.misfit + 26)
    verdict = decided(refit("mass", LIMITS.gain - 5, 10), places=(there,), beyond_priors=["kt x 1.5", "E x 1.05"])
    assert (verdict.finding, verdict.place, verdict.beyond_priors) == (Finding.UNKNOWN, None, ["kt x 1.5", "E x 1.05"])
    assert "more than its priors allow, in kt x 1.5 and E x 1.05, and" in verdict.sentence
    # With an effect that explains the data its own fit counts; and without one not even a small misfit is nothing.
    assert decided(refit("mass", 100, 80), beyond_priors=["kt x 1.5"]).beyond_priors == ()
    # Nor is nothing missing where a parameter has taken up all that it may.
    nothing = decided(refit("mass", 5, 5), beyond_priors=["kt x 1.5"])
    assert (nothing.finding, nothing.beyond_priors) == (Finding.UNKNOWN, ["kt x 1.5"])


def test_an_unknown_force_is_no_more_than_an_effect_that_held_out_data_speak_against() -> None:
    """A spring gains what the unknown force does, and the held-out data lose by it: the error is of the fitted ones."""
    gain = LIMITS.misfit + 20
    assert decided(refit("spring", gain, -7), places=(place(gain + 6),)).finding is Finding.NOTHING
    # What the unknown force gains beyond the spring is another matter.
    more = place(gain + LIMITS.misfit + 8)
    assert decided(refit("spring", gain, -7), places=(more,)).finding is Finding.UNKNOWN


def test_what_is_left_is_looked_at_once_and_only_where_something_passes() -> None:
    asked: list[str] = []
    decided(refit("mass", 5, 5), asked=asked)
    assert asked == []
    decided(refit("mass", 100, 80), refit("spring", 99, 80), asked=asked)
    assert asked == [f"what is left beside mass of 1, limit {LIMITS.gain:.6g}"]


def make_law(
    gain: float, held_out_gain: float = 0.0, kind: str = "clearance", *, is_distinct: bool = True
) -> FittedLaw:
    """A law in place of that of a cubic spring."""
    law = replace(refit(f"{kind} for cubic at tip", 0.0, 0.0), held_out_error=0.05)
    words = f"a force of the kind {kind}"
    return FittedLaw(refit=law, gain=gain, held_out_gain=held_out_gain, words=words, is_distinct=is_distinct)


@pytest.mark.parametrize(
    ("law", "finding"),
    [
        (make_law(7.0), Finding.UNKNOWN),
        (make_law(6.0), Finding.AMBIGUOUS),  # chance: a chi-square of one degree of freedom exceeds 6.63 in 1 %
        (make_law(7.0, -0.3), Finding.UNKNOWN),
        (make_law(7.0, -0.4), Finding.AMBIGUOUS),  # what the held-out data lose is more than what is beyond chance
        (make_law(100.0, -DECISIVE), Finding.AMBIGUOUS),  # the held-out data refute it
        (make_law(200.0, is_distinct=False), Finding.MISSING),  # a cubic, nearly
        (make_law(-5.0, -0.9), Finding.AMBIGUOUS),
        (make_law(-5.0, -1.1), Finding.MISSING),  # 5.99: odds of one in twenty
    ],
)
def test_a_force_of_another_law_is_none_of_the_known_effects(law: FittedLaw, finding: Finding) -> None:
    verdict = decided(refit("cubic at tip", 100, 80), places=(place(90),), laws=[law])
    assert verdict.finding is finding
    assert len(verdict.laws) == (finding is not Finding.MISSING)
    if finding is Finding.UNKNOWN:
        assert verdict.place is not None
        assert verdict.place.name == "tip"
        assert "near tip, a force of the kind clearance" in verdict.sentence


@pytest.mark.parametrize(("by_cubic", "by_law", "finding"), [
    (5.0, 3.0, Finding.UNKNOWN),
    (1.5, 1.0, Finding.MISSING),  # noise explains what the cubic spring leaves
    (5.0, 5.5, Finding.MISSING),  # no law leaves less
])  # fmt: skip
def test_where_a_cubic_spring_leaves_much_a_law_is_weighed_by_its_own_covariance(
    by_cubic: float, by_law: float, finding: Finding
) -> None:
    """By the covariance of the cubic spring, which is that of a poor model, the true law gains nothing."""
    law, cubic = make_law(-70.0, -15.0), refit("cubic at tip", 100, 80)
    law = replace(law, refit=replace(law.refit, reduced_chi2_without_model_error=by_law))
    cubic = replace(cubic, reduced_chi2_without_model_error=by_cubic)
    assert decided(cubic, laws=[law], own_law=make_law(90.0, 60.0)).finding is finding


def test_of_laws_that_cannot_be_told_apart_the_best_of_each_kind_is_told() -> None:
    laws = [make_law(-3.0, kind="power"), make_law(-2.0), make_law(-1.0), make_law(-90.0, kind="even")]
    verdict = decided(refit("cubic at tip", 100, 80), laws=laws)
    assert [law.words for law in verdict.laws] == ["a force of the kind clearance", "a force of the kind power"]


@pytest.mark.parametrize(("held_out_gain", "finding"), [(45.0, Finding.UNKNOWN), (35.0, Finding.NOTHING)])
def test_an_effect_that_held_out_data_refute_may_have_another_law(held_out_gain: float, finding: Finding) -> None:
    refuted = refit("cubic at tip", 100, -40)
    assert decided(refuted, laws=[make_law(50.0, held_out_gain)]).finding is finding


@pytest.mark.parametrize(("more", "finding"), [(1.0, Finding.UNKNOWN), (-1.0, Finding.MISSING)])
def test_a_cubic_spring_may_stand_for_another_law_at_another_place(more: float, finding: Finding) -> None:
    """A quadratic spring: a softening cubic spring at another place leaves nothing."""
    best, other = refit("cubic at tip", 100, 80), refit("cubic at root", 90, 60)
    behind = compute_log_density(best) - compute_log_density(other)
    law = make_law(behind + DECISIVE + more, kind="even")

    def laws_of(name: str) -> list[FittedLaw]:
        return [law] if "root" in name else []

    verdict = decided(best, other, places=(place(90),), laws_of=laws_of)
    assert verdict.finding is finding
    assert [item.words for item in verdict.laws] == (["a force of the kind even"] if finding is Finding.UNKNOWN else [])


@pytest.mark.parametrize(("whole", "left", "finding"), [
    (200.0 + DECISIVE + 1, 150.0, Finding.UNKNOWN),
    (200.0 + DECISIVE - 1, 150.0, Finding.UNKNOWN),
    (200.0 + DECISIVE + 1, 0.0, Finding.MISSING),
])  # fmt: skip
def test_where_the_best_effect_leaves_much_another_one_may_have_the_law_that_explains_all(
    whole: float, left: float, finding: Finding
) -> None:
    rest = ResidualExplanation(gain=left, effect_name="gap", places=(), known_effect_gain=left)
    mass, cubic = refit("mass", 200, 150), refit("cubic at tip", 100, 50)
    verdict = decided(mass, cubic, rest=rest, laws=[make_law(whole - 50, 50.0)])
    assert verdict.finding is finding
    # The mass is a stand-in; what it stands in for is told if its law is more probable, to odds of one in twenty.
    assert bool(verdict.laws) == (bool(left) and whole > 200 + DECISIVE)


@pytest.mark.parametrize(("left", "held", "finding"), [
    (1.0, -DECISIVE - 1, Finding.MISSING),
    (1.0, -LIMITS.gain, Finding.MISSING),
    (1.5, -DECISIVE - 1, Finding.UNKNOWN),
])  # fmt: skip
def test_what_held_out_data_refute_is_no_cause_of_what_is_left_where_the_effect_explains_these(
    left: float, held: float, finding: Finding
) -> None:
    """Held-out data of 3 before: an effect that leaves 1.5 of it leaves more than 15 % of what it explains."""
    further = refit("spring", 150, held)
    rest = ResidualExplanation(gain=150, effect_name="spring", places=(), known_effect_gain=150, refit=further)
    before = replace(BEFORE, held_out_reduced_chi2_without_model_error=3.0)
    mass = replace(refit("mass", 200, 150), held_out_reduced_chi2_without_model_error=left)
    assert decided(mass, rest=rest, baseline=before).finding is finding


def test_gains_count_over_what_a_fit_leaves() -> None:
    """A fit whose residuals are twice as large as the covariance says has gains four times as large by chance."""
    twice = SimpleNamespace(chi2=4.0 * N_TRAIN, n_number=N_TRAIN)
    mass = refit("mass", 4 * LIMITS.gain - 1, 80)
    assert decided(mass).finding is Finding.MISSING
    assert decided(replace(mass, fit=twice)).finding is Finding.NOTHING  # type: ignore[arg-type]
    there = place(4 * LIMITS.misfit + 5)
    twice.chi2 += there.gain
    assert decided(places=(there,)).finding is Finding.UNKNOWN
    assert decided(places=(there,), baseline=replace(BEFORE, fit=twice)).finding is Finding.NOTHING  # type: ignore[arg-type]


def test_effects_are_told_apart_where_densities_and_gains_agree() -> None:
    """Densities are by the covariances of their own models, gains by the worse one of two."""
    one, other = replace(refit("mass", 200, 80), cost=-900.0), replace(refit("spring", 220, 80), cost=-920.0)
    assert named(decided(one, other)) == ["spring"]
    verdict = decided(replace(one, gain=240.0), other)
    assert sorted(named(verdict)) == ["mass", "spring"]
    assert verdict.probabilities == pytest.approx([0.5, 0.5], abs=1e-4)


def test_smallest_strengths_gain_the_limit() -> None:
    parameter = EffectParameter(name="mass", unit="kg", lower=-0.1, upper=0.1, typical=0.01)
    effect: Any = SimpleNamespace(name="mass", parameters=(parameter,))
    none = np.zeros(1)
    score = Score(effect=effect, strength=0.0, gain=0.0, size=5.0, absorbed=0.0, direction=none, start=none, slope=none)
    verdict = decided(scores=(score,))
    # A strength of one standard deviation, 0.01 / 5, gains 1; gains grow with its square.
    assert verdict.detectable == {"mass": pytest.approx(LIMITS.gain**0.5 * 0.002)}
    assert verdict.units == {"mass": "kg"}


def test_what_no_data_can_tell_from_the_best_is_named_before_what_is_improbable() -> None:
    fits = [refit("mass", 100, 80), refit("spring", 94, 80), refit("shift", 88, 80)]
    directions = {"mass": [1.0, 0.0], "spring": [0.0, 1.0], "shift": [-1.0, 0.0]}
    scores: Any = tuple(
        SimpleNamespace(
            effect=item.effect,
            direction=np.array(directions[item.name]),
            size=1.0,
            detectable=1.0,
            begins=0.0,
            gain=item.gain,
        )
        for item in fits
    )
    for score in scores:
        vars(score.effect.parameters[0]).update(lower=-10.0, upper=10.0)
    verdict = decided(*fits, scores=scores)
    assert named(verdict) == ["mass", "shift"]
    assert verdict.probabilities[0] == verdict.probabilities[1]
    assert named(decided(*fits)) == ["mass"]
