r"""Rules that lead from refits to a verdict.

An effect passes if the training data gain more by it than the detection threshold, less what the held-out data lose: an
effect that fits noise makes these worse by as much as it gains. Effects are ranked by the density of all data, each by
its own covariance. Effects so close to the best that the data cannot distinguish them are named with it. It is named
without doubt only if the held-out data confirm it. Then other laws are fitted in place of that of the best one: a force
that has one is another force. And the remaining residual is examined. If another effect explains a good part of it, and
both together leave no unknown force, both are missing; at one place both together are one force whose law is not known.
If an unknown force explains a good part of the gain of the best one, that one only stands in for it, and none of the
known effects is the cause. The same holds if a linear effect leaves an unknown force that is no known effect: a force
that varies with the amplitude has a linear part, and what takes up this part may gain a great deal. An effect that
varies with the amplitude as well is the known one that is nearest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.model import Model
from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.decision.closeness import AbsentPeak, FarResonance, tell_held_back
from diagnosis.decision.law_of_force import FittedLaw, find_better, find_rivals, fit_other_laws, has_other_laws
from diagnosis.decision.verdict import Finding, Verdict, held_out_fall, smallest_detectable
from diagnosis.error_share import compute_suited_gains
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Fit
from diagnosis.fit.finalist import Finalist, is_worse
from diagnosis.fit.problem import UNEXPLAINED, Refit
from diagnosis.fit.refit import quick_fit
from diagnosis.screening import Score, screen
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce, find_unknown_forces, misfit
from geometry.plain_number import plain

#: Probability that one of the effects that are named is the true one, if one of those that pass is.
CREDIBLE = 0.95
#: Share of the gain of the best effect that others may gain beyond the threshold, and of the error that it may leave.
STAND_IN = 0.15
#: Share of the gain of an unknown force beside the best effect from which on a known one explains it, to first order as
#: well: it is then the next effect to be named.
KNOWN = 0.5
#: Held-out error that is large [-].
LARGE = 0.1
#: |cos| of the changes by two effects from which on they are alike.
ALIKE = 0.99
#: Change of -2 ln p by which held-out data refute an effect, or confirm it: odds of one in twenty.
DECISIVE = 2 * np.log(20)
#: Largest number of effects whose linear gain is checked by a fit.
CHECKED = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Leftover:
    """Gain that remains beside an effect.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best further effect: linear, or by a fit where the linear one exceeds the threshold.
    name
        Name of this effect.
    places
        Places where an unknown force would explain the rest, best first.
    known
        Largest gain of a known effect by the covariances of `places`, to first order.
    further
        That effect beside the first one, where it was fitted.
    """

    gain: float
    name: str
    places: tuple[UnknownForce, ...]
    known: float
    further: Refit | None = None


def with_effect(arrangement: Arrangement, refit: Refit) -> Arrangement:
    """Arrangement of the same measurements with an effect added to the model."""
    assert refit.effect is not None
    fit = refit.fit
    slopes = arrangement.train.slopes(fit.unknowns, fit.values, fit.model, fit.prediction)
    jacobian = np.concatenate([slopes, np.diag(1 / fit.unknowns.prior)])
    return replace(arrangement, added=(*arrangement.added, refit.effect), fit=replace(fit, jacobian=jacobian))


def find_leftover(arrangement: Arrangement, effects: Sequence[Effect], worth: float = np.inf) -> Leftover:
    """Gain that remains once an effect is added, see `with_effect`.

    Parameters
    ----------
    arrangement
        Arrangement with the effect.
    effects
        Candidates; the best few whose linear gain exceeds `worth` are fitted, since the linear gain of an effect on
        contacts that begin to slip may be far too large.
    worth
        Gain that matters [-].
    """
    by_covariance = compute_suited_gains(arrangement, effects)
    gains, fits = by_covariance.max(axis=0, initial=0.0), dict[int, Fit]()
    promising = [number for number in np.argsort(-gains).tolist() if gains[number] > worth]
    for place, number in enumerate(promising):
        if place < CHECKED:
            (score,) = screen(arrangement, [effects[number]])
            fits[number] = quick_fit(arrangement, score)
            gains[number] = arrangement.cost - arrangement.cost_with_error_left(fits[number])
        else:
            gains[number] = worth
    best = int(np.argmax(gains)) if len(gains) else -1
    further = None
    if best in fits:
        tested = arrangement.tested(effects[best], fits[best])
        alone = arrangement.tested(None, arrangement.fit)
        further = replace(
            tested, gain=float(gains[best]), held_gain=alone.held_cost - tested.held_cost,
            worsens=is_worse(tested, alone),
        )  # fmt: skip
    return Leftover(
        gain=float(gains[best]) if best >= 0 else 0.0,
        name=effects[best].name if best >= 0 else "",
        places=tuple(find_unknown_forces(arrangement)),
        known=float(by_covariance.max(initial=0.0)),
        further=further,
    )


def find_force_beside(arrangement: Arrangement, refit: Refit) -> float:
    """Excess gain of an unknown force beside an effect that is added to those of an arrangement."""
    return max((misfit(place) for place in find_unknown_forces(with_effect(arrangement, refit))), default=0.0)


class Gate(Protocol):
    """Conditions for refits to be named, by the statistics of one kind of data."""

    def passes(self, refit: Refit) -> bool:
        """Whether an effect is significant."""
        ...

    def explains(self, refit: Refit) -> bool:
        """Whether an effect that passes leaves little enough, and stands in for no other."""
        ...

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best of the effects that pass, which come best first, and those that the data cannot tell from it."""
        ...

    def is_unexplained(self) -> bool:
        """Whether something is missing though no effect passes."""
        ...


def find(gate: Gate, refits: Sequence[Refit]) -> tuple[Finding, list[Refit]]:
    """Finding, and the effects that it names, from refits in order, best first."""
    passed = [refit for refit in refits if gate.passes(refit)]
    if not passed:
        return (Finding.UNKNOWN if gate.is_unexplained() else Finding.NOTHING), []
    if not gate.explains(passed[0]):
        return Finding.UNKNOWN, []
    chosen = gate.choose(passed)
    return (Finding.AMBIGUOUS if len(chosen) > 1 else Finding.MISSING), chosen


def support(refit: Refit) -> float:
    """2 ln of the density of the training and the held-out data together, by its own covariance, up to a constant.

    Falls of chi^2 tell whether an effect is there; those of two effects have covariances of their own, and do not say
    which of both it is.
    """
    return refit.gain + refit.held_gain if refit.cost is None else -refit.cost


def compute_probabilities(refits: Sequence[Refit]) -> Float[NDArray[np.float64], " n"]:
    """Probability of each of several effects, one of which is the true one, shape (n,) [-]."""
    supports = np.array([support(each) for each in refits], dtype=np.float64)
    weight = np.exp((supports - supports.max(initial=-np.inf)) / 2)
    return np.asarray(weight / weight.sum())


def compute_spread(refit: Refit, gain: float = 0.0) -> float:
    """Reduced chi-squared that a fit leaves, or would beside a further gain, at least 1 [-].

    Gains scatter by as much more than the thresholds say: a covariance is an estimate as well, and what a good fit
    leaves beyond it, no effect explains (Birge, Phys. Rev. 40 (1932), 207-227).
    """
    return max((refit.fit.chi2 - gain) / refit.fit.n_number, 1.0)


def passes(refit: Refit, thresholds: Thresholds) -> bool:
    """Whether the training data gain more by an effect than chance does, and the held-out data do not refute it."""
    return bool(compute_evidence(refit) > thresholds.gain * compute_spread(refit))


def compute_evidence(refit: Refit) -> float:
    """Fall of -2 ln p of the training data, less what the held-out data lose; none if these refute the effect [-]."""
    refuted = refit.worsens or refit.held_gain <= -DECISIVE
    return 0.0 if refuted else refit.gain + min(refit.held_gain, 0.0)


def errs_on_held_out(refit: Refit) -> bool:
    """Whether a large error of the held-out data is left that noise and stated errors do not explain."""
    return refit.held_error > LARGE and refit.held_misfit > UNEXPLAINED


def decide(
    catalogue: Catalogue,
    scores: Sequence[Score],
    before: Refit,
    finalists: Sequence[Finalist],
    places: Sequence[UnknownForce],
    thresholds: Thresholds,
    run_step: RunStep,
    left: ErrorSize = NO_ERROR,
    far: FarResonance | AbsentPeak | None = None,
    held_back: Sequence[str] = (),
) -> Verdict:
    """Verdict.

    Parameters
    ----------
    catalogue, scores, before, places, thresholds
        See `diagnosis.diagnose.Diagnosis`.
    finalists
        Finalists, best first.
    run_step
        Looks up the stored result of a step, or computes it.
    left
        Model error that is left without an effect; where one passes, that which is left beside it counts.
    far
        A measured resonance that is far from those of the model, or a predicted one that is absent.
    held_back
        Calibration parameters of `before` that are as far as their priors let a fit go.
    """
    arrangements = {each.name: each.arrangement for each in finalists}
    refuted = max((each.refit.gain for each in finalists if each.refit.held_gain < 0), default=0.0)
    passed = [each for each in finalists if passes(each.refit, thresholds)]
    passing = [each.refit for each in passed]
    gate = _ChanceGate(arrangements, catalogue, places, thresholds, run_step, before, max(refuted, 0.0), passing)
    finding, effects = find(gate, [each.refit for each in finalists])
    left, reason = passed[0].arrangement.left if passed else left, ""
    if left.is_far or far is not None:
        finding, effects = Finding.NOT_CLOSE, []
        reason = "" if far is None else far.sentence
    if finding is Finding.NOTHING and gate.generalises_by_another_law([each.refit for each in finalists]):
        finding = Finding.UNKNOWN
    laws = gate.find_rival_laws(effects[0]) if effects else []
    if finding is Finding.MISSING and (laws or not gate.is_confirmed(effects[0])):
        finding = Finding.AMBIGUOUS
    if finding is Finding.NOTHING and errs_on_held_out(before):
        finding, reason = Finding.UNKNOWN, _tell_held_out_error(before)
    found = finding is Finding.UNKNOWN and not gate.laws and gate.is_unexplained()
    place, nearest = places[0] if found else None, passed[0].refit if found and passed else None
    if finding is Finding.UNKNOWN and gate.laws:
        ((name, law),) = gate.laws.items()
        place = next((each for each in places if each.name == _place_of(name)), None)
        nearest = next(each.refit for each in finalists if each.name == name)
        reason = _tell_law(name, law, before)
    elif finding is Finding.UNKNOWN and not found and gate.left:
        ((name, rest),) = gate.left.items()
        reason = _tell_stand_in(name, rest, thresholds)
    if finding is Finding.UNKNOWN:
        laws = [*gate.laws.values()]
    else:
        held_back = ()
    if held_back:
        place, nearest, reason, laws = None, None, tell_held_back(held_back), []
    return Verdict(
        finding=finding, effects=effects, before=before, threshold=thresholds.gain,
        detectable=smallest_detectable(scores, thresholds.gain),
        units={score.effect.name: score.effect.parameters[0].unit for score in scores},
        place=place, nearest=nearest, model_error=left,
        reason=reason, further=gate.further if effects else None,
        alike=_find_alike(scores, effects, finalists),
        laws=laws, held_back=held_back,
        probabilities=[*gate.rank(effects[0]).values()][: len(effects)] if effects else [],
    )  # fmt: skip


def find_untestable(verdict: Verdict, is_seen: bool) -> Verdict:
    """The verdict, or that nothing could be tested.

    That nothing is missing says something only where an effect would have shown. And what is far off, where no motion
    stands out of its scatter, is noise.

    Parameters
    ----------
    verdict
        Of the rules.
    is_seen
        Whether any motion stands out of its scatter.
    """
    why = ""
    if not is_seen and verdict.finding in {Finding.NOTHING, Finding.NOT_CLOSE}:
        why = "no motion stands out of the scatter between its repeats"
    elif verdict.finding is Finding.NOTHING and not np.isfinite([*verdict.detectable.values()]).any():
        why = "no effect would show in them at any strength that it may have"
    if not why:
        return verdict
    reason = f"These measurements cannot tell whether anything is missing: {why}."
    return replace(verdict, finding=Finding.NOT_TESTABLE, reason=reason)


def _find_alike(scores: Sequence[Score], effects: Sequence[Refit], finalists: Sequence[Finalist]) -> list[str]:
    """Effects that change the data as the best does and were not fitted to the end, where all that were are named."""
    directions = {score.effect.name: score.direction for score in scores}
    best = directions.get(effects[0].name) if effects else None
    if best is None or len(effects) < max(2, len(finalists)):
        return []
    fitted = {each.name for each in finalists}
    return [name for name, each in directions.items() if name not in fitted and abs(float(each @ best)) > ALIKE]


def _tell_law(name: str, law: FittedLaw, before: Refit) -> str:
    falls = held_out_fall(before, law.refit)
    return (
        f"Something is missing, and it is none of the known effects: near {_place_of(name)}, {law.words}, by which "
        f"{falls}. Nearest is {name}."
    )


def _tell_stand_in(name: str, rest: Leftover, thresholds: Thresholds) -> str:
    unknown = misfit(rest.places[0]) - thresholds.misfit if rest.places else -np.inf
    if rest.gain - thresholds.gain > unknown:
        alone = "no known effect alone explains it"
        return f"Something is missing, and {alone}: {name} explains most, and {rest.name} much of what it leaves."
    left = rest.places[0].sentence
    return f"Something is missing, and it is none of the known effects: {name} explains most, but leaves {left}."


def _tell_held_out_error(before: Refit) -> str:
    """A large error of the held-out data, beside that of the training data, in words."""
    held_out, others = (f"{plain(100 * error)} %" for error in (before.held_error, before.error))
    if _stated(before) > UNEXPLAINED:
        return (
            f"Something is missing, and no known effect explains it: the calibrated model errs by {held_out} on the "
            f"held-out data and by {others} on the others."
        )
    return (
        f"Something is missing that the held-out data alone show: the model errs by {held_out} there and by {others} "
        "on the others, in which nothing is missing. Hold out other data, so that a fit sees these."
    )


@dataclass(frozen=True, eq=False)
class _ChanceGate:
    """Gains compared with the detection thresholds, in training and held-out data."""

    arrangements: Mapping[str, Arrangement]
    catalogue: Catalogue
    places: Sequence[UnknownForce]
    thresholds: Thresholds
    run_step: RunStep
    before: Refit
    refuted: float
    """Largest gain of an effect that the held-out data speak against: a force that gains no more is as wrong."""
    passing: Sequence[Refit]
    """Effects that pass."""
    left: dict[str, Leftover] = field(default_factory=dict)
    """What is left beside effects that were asked for, by name."""
    together: dict[str, Refit] = field(default_factory=dict)
    """Effects that are missing as well, by the name of the first one."""
    fitted: dict[str, list[FittedLaw]] = field(default_factory=dict)
    """Laws that were fitted in place of those of effects, by the names of these."""
    laws: dict[str, FittedLaw] = field(default_factory=dict)
    """Laws that forces turned out to have in place of those of effects, by the names of these."""

    @property
    def further(self) -> Refit | None:
        """An effect that is missing beside the one that was asked for."""
        return next(iter(self.together.values()), None)

    def passes(self, refit: Refit) -> bool:
        return passes(refit, self.thresholds)

    def explains(self, refit: Refit) -> bool:
        law = self._find_another_law(refit)
        if law is not None:
            self.laws[refit.name] = law
            return False
        others = [each for each in self.catalogue.candidates if each.name != refit.name]
        rest = self.run_step(
            f"what is left beside {refit.name}, limit {self.thresholds.gain:.6g}",
            lambda: find_leftover(with_effect(self.arrangements[refit.name], refit), others, self.thresholds.gain),
        )
        self.left[refit.name] = rest
        assert refit.effect is not None
        linear = is_linear(refit.effect, self.arrangements[refit.name].fit.model)
        stands_in = _stand_in(refit, self.before, rest, self.thresholds, linear)
        return not stands_in or self._explains_with(refit, rest.further)

    def _fit_other_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the force of an effect may have instead, fitted."""
        if not has_other_laws(refit.effect):
            return []
        if refit.name not in self.fitted:
            arrangement = self.arrangements[refit.name]
            self.fitted[refit.name] = self.run_step(
                f"other laws of {refit.name}",
                lambda: fit_other_laws(arrangement, with_effect(arrangement, refit).cost, refit),
            )
        return self.fitted[refit.name]

    def _find_another_law(self, refit: Refit) -> FittedLaw | None:
        """The law of a force, if it is another one than the effect's."""
        chance = float(chdtri(1, self.thresholds.false_alarms)) * compute_spread(refit)
        return find_better(self._fit_other_laws(refit), chance)

    def is_confirmed(self, refit: Refit) -> bool:
        """Whether the held-out data speak for an effect, or for it and the one that is missing as well."""
        more = 0.0 if self.further is None else self.further.held_gain
        return bool(refit.held_gain + more >= DECISIVE)

    def find_rival_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the data do not refute in place of that of an effect."""
        return find_rivals(self._fit_other_laws(refit), DECISIVE)

    def generalises_by_another_law(self, refits: Sequence[Refit]) -> bool:
        """Whether the best effect that gains lowers the held-out error by another law of its force alone."""
        chance = self.thresholds.gain
        refit = next((each for each in refits if each.gain > chance * compute_spread(each)), None)
        law = None if refit is None else self._find_another_law(refit)
        if refit is None or law is None:
            return False
        if not (refit.held_gain + law.held_gain > 0 and law.refit.held_error < self.before.held_error):
            return False
        self.laws[refit.name] = law
        return True

    def _explains_with(self, refit: Refit, further: Refit | None) -> bool:
        """Whether an effect and a further one explain together what either does not."""
        if further is None or not passes(further, self.thresholds) or _share_place(refit, further):
            return False
        force = self.run_step(
            f"force beside {refit.name} and {further.name}",
            lambda: find_force_beside(with_effect(self.arrangements[refit.name], refit), further),
        )
        if force - self.thresholds.misfit > STAND_IN * (refit.gain + further.gain):
            return False
        self.together[refit.name] = further
        return True

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        ranked = self.rank(passed[0])
        count = 1 + int(np.searchsorted(np.cumsum([*ranked.values()]), CREDIBLE))
        by_name = {each.name: each for each in self.passing}
        return [by_name[name] for name in ranked][:count]

    def rank(self, best: Refit) -> dict[str, float]:
        """Probabilities by name: of the best effect, then of all others that pass, the largest first."""
        ranked = [best, *sorted((each for each in self.passing if each is not best), key=lambda each: -support(each))]
        return {each.name: share for each, share in zip(ranked, compute_probabilities(ranked).tolist(), strict=True)}

    def is_unexplained(self) -> bool:
        if not self.places:
            return False
        left = compute_spread(self.before, self.places[0].gain)
        return misfit(self.places[0]) - self.refuted > self.thresholds.misfit * left


def is_linear(effect: Effect, model: Model) -> bool:
    """Whether an effect changes no joint of a model, so that it acts alike at all amplitudes."""
    changed = effect.apply(model, [parameter.typical for parameter in effect.parameters])
    before, after = model.system.joints, changed.system.joints
    return len(before) == len(after) and all(one is other for one, other in zip(before, after, strict=True))


def _share_place(refit: Refit, other: Refit) -> bool:
    """Whether two effects act at one place."""
    places = [_place_of(each.name) for each in (refit, other)]
    return bool(places[0]) and places[0] == places[1]


def _place_of(name: str) -> str:
    """Place of an effect by its name; empty for one that acts at none."""
    return name.partition(" at ")[2]


def _stand_in(refit: Refit, before: Refit, rest: Leftover, thresholds: Thresholds, linear: bool) -> bool:
    """Whether something else gains a good part of an effect's gain, or a linear one leaves what is no known one."""
    unknown = misfit(rest.places[0]) - thresholds.misfit if rest.places else 0.0
    beyond = max(rest.gain - thresholds.gain, unknown)
    is_left = _stated(refit) > UNEXPLAINED
    if linear and unknown > 0 and rest.known < KNOWN * rest.places[0].gain and is_left:
        return True
    return beyond > STAND_IN * refit.gain and not _explains_nearly_all(refit, before)


def _explains_nearly_all(refit: Refit, before: Refit) -> bool:
    """Whether an effect leaves less than the share `STAND_IN` of an error that noise and stated errors do not explain.

    Without it, model error of the size of the responses may explain as much as the effect does, and gains are small.
    """
    was, left = _stated(before), _stated(refit)
    return was > UNEXPLAINED and left - 1 < STAND_IN**2 * (was - left)


def _stated(refit: Refit) -> float:
    """Reduced chi-squared by noise and stated errors."""
    return refit.fit.chi2 / refit.fit.n_number if refit.stated_chi2 is None else refit.stated_chi2
