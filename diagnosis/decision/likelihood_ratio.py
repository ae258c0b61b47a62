"""Likelihood-ratio test of effects by steady states: falls of -2 ln p against their detection thresholds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtri

from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.decision.closeness import list_held_back
from diagnosis.decision.evidence import (
    DECISIVE,
    compute_birge_ratio,
    compute_log_density,
    compute_probabilities,
    exceeds_threshold,
    passes,
)
from diagnosis.decision.law_of_force import FittedLaw, find_alternatives, find_better, fit_other_laws, has_other_laws
from diagnosis.decision.pair import Pair, fit_pair
from diagnosis.decision.residual_explanation import ResidualExplanation, add_effect, explain_residual
from diagnosis.effect import find_kind
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED, Refit
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce, compute_excess_gain

#: Probability that one of the effects that are named is the true one, if one of those that pass is.
CREDIBLE = 0.95
#: Share of the gain of the best effect that others may gain beyond the threshold, and of the error that it may leave.
STAND_IN = 0.15
#: Rise of a relative error that is none: an effect on forces moves it, too [-].
ERROR_ROUNDED = 0.01
#: Share of the gain of an unknown force beside the best effect from which on a known one explains it, to first order as
#: well: it is then the next effect to be named.
KNOWN = 0.5


@dataclass(eq=False)
class LikelihoodRatioTest:
    """Test of effects by their gains in training and held-out data, against the detection thresholds."""

    finalists: Mapping[str, Finalist]
    """Effects by their own covariances, by name."""
    catalogue: Catalogue
    places: Sequence[UnknownForce]
    thresholds: Thresholds
    run_step: RunStep
    baseline: Refit
    refuted: float
    """Largest gain of an effect that the held-out data speak against: an unknown force of no more gain is as wrong."""
    explanations: dict[str, ResidualExplanation] = field(default_factory=dict)
    """What would explain the residual beside an effect, by the name of the effect; filled as effects are tested."""
    pair: Pair | None = None
    """Two effects that are missing together, where the tested one does not explain enough alone."""
    instead: Finalist | None = None
    """Effect beside which the tested one does not pass: it is to be judged alone."""
    fitted: dict[str, list[FittedLaw]] = field(default_factory=dict)
    """Laws that were fitted in place of the law of an effect, by the name of the effect."""
    laws: dict[str, FittedLaw] = field(default_factory=dict)
    """Law that a force was found to have in place of the law of an effect, by the name of the effect."""

    def passes(self, refit: Refit) -> bool:
        """Whether an effect is significant."""
        return passes(refit, self.thresholds)

    def explains(self, refit: Refit) -> bool:
        """Whether little is left beside an effect, or beside it and a further one, and its force has no other law."""
        law = self._find_another_law(refit)
        if law is not None:
            self.laws[refit.name] = law
            return False
        residual = self._explain_residual(refit)
        assert refit.effect is not None
        linear = is_linear(refit.effect, self.finalists[refit.name].arrangement.fit.model)
        if not _stand_in(refit, self.baseline, residual, self.thresholds, linear):
            return True
        self.pair = self._find_pair(refit, residual.refit)
        return self.pair is not None

    def finds_two(self, refits: Sequence[Refit]) -> bool:
        """Whether the held-out data speak for two effects of which the one that gains most does not pass alone.

        Both leave no more than noise and stated errors explain: what each alone leaves is why it does not pass.
        """
        first = max(
            (each for each in refits if exceeds_threshold(each, self.thresholds)), key=compute_log_density, default=None
        )
        if first is None or self._find_another_law(first) is not None:
            return False
        further = self._explain_residual(first).refit
        if further is None or further.reduced_chi2_by_noise > UNEXPLAINED:
            return False
        pair = self._find_pair(first, further)
        if pair is None or self._rises(pair.second.refit) or self._compute_held_gain(pair) < DECISIVE:
            return False
        self.pair = pair
        return True

    def _explain_residual(self, refit: Refit) -> ResidualExplanation:
        """What would explain the residual that an effect leaves."""
        if refit.name not in self.explanations:
            others = [each for each in self.catalogue.candidates if each.name != refit.name]
            limit = self.thresholds.gain
            self.explanations[refit.name] = self.run_step(
                f"what is left beside {refit.name} of {refit.strength:.6g}, limit {limit:.6g}",
                lambda: explain_residual(add_effect(self.finalists[refit.name].arrangement, refit), others, limit),
            )
        return self.explanations[refit.name]

    def _fit_other_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the force of an effect may have instead, fitted."""
        if not has_other_laws(refit.effect):
            return []
        if refit.name not in self.fitted:
            arrangement = self.finalists[refit.name].arrangement
            self.fitted[refit.name] = self.run_step(
                f"other laws of {refit.name} of {refit.strength:.6g}",
                lambda: fit_other_laws(arrangement, add_effect(arrangement, refit).cost, refit),
            )
        return self.fitted[refit.name]

    def _find_another_law(self, refit: Refit) -> FittedLaw | None:
        """The law of a force, if it differs from that of the effect; else None."""
        chance = float(chdtri(1, self.thresholds.false_alarms)) * compute_birge_ratio(refit)
        return find_better(self._fit_other_laws(refit), chance)

    def is_confirmed(self, refit: Refit) -> bool:
        """Whether the held-out data confirm an effect, or the pair of it and a further one.

        Their density must rise decisively. Neither with the effect alone nor with the pair may their reduced
        chi-squared by noise rise, nor their relative error where noise does not explain it. An effect that takes mass
        or stiffness away is not confirmed, since errors of a model do so as well; nor is one whose fit has a
        calibration parameter at a bound.
        """
        both = [refit] if self.pair is None else [refit, self.pair.second.refit]
        held_out_gain = refit.held_out_gain if self.pair is None else self._compute_held_gain(self.pair)
        strained = list_held_back(refit.fit) or any(map(takes_away, both))
        rises = self._rises(refit) or self._rises(self.finalists[refit.name].refit)
        return bool(held_out_gain >= DECISIVE and not rises and not strained)

    def _compute_held_gain(self, pair: Pair) -> float:
        """Fall of -2 ln p of the held-out data by two effects: by the first alone, and by the second beside it [-]."""
        return self.finalists[pair.first.name].refit.held_out_gain + pair.second.refit.held_out_gain

    def _rises(self, refit: Refit) -> bool:
        """Whether held-out data are further off with an effect; chi^2 within a standard deviation is noise."""
        if refit.held_out_reduced_chi2_by_noise <= 1 + np.sqrt(2 / max(refit.n_held_out, 1)):
            return False
        larger = refit.held_out_error > (1 + ERROR_ROUNDED) * self.baseline.held_out_error
        return bool(larger or refit.held_out_reduced_chi2_by_noise > self.baseline.held_out_reduced_chi2_by_noise)

    def find_alternative_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the data do not refute in place of that of an effect."""
        return find_alternatives(self._fit_other_laws(self.finalists[refit.name].refit), DECISIVE)

    def generalises_by_another_law(self, refits: Sequence[Refit]) -> bool:
        """Whether the best effect that gains lowers the held-out error by another law of its force alone."""
        refit = next((each for each in refits if exceeds_threshold(each, self.thresholds)), None)
        law = None if refit is None else self._find_another_law(refit)
        if refit is None or law is None:
            return False
        if not (
            refit.held_out_gain + law.held_out_gain > 0 and law.refit.held_out_error < self.baseline.held_out_error
        ):
            return False
        self.laws[refit.name] = law
        return True

    def _find_pair(self, refit: Refit, further: Refit | None) -> Pair | None:
        """An effect, or one in its place, and a further one that explain together what either does not."""
        if further is None or not passes(further, self.thresholds):
            return None
        pair = self._fit_pair(refit, further)
        if not passes(pair.first.refit, self.thresholds):
            self.instead = pair.alone
            return None
        first = self._choose_first(pair)
        if first is None:
            return None
        if first is not pair.first:
            # By its own covariance it is tested beside the further one as the other was.
            beside_it = replace(first.refit, effect=further.effect, beside=None)
            pair = self._fit_pair(self.finalists[first.name].refit, beside_it)
        second, force = pair.second.refit, pair.force - self.thresholds.misfit
        if not (passes(pair.first.refit, self.thresholds) and passes(second, self.thresholds)):
            return None
        if force > STAND_IN * (self.finalists[first.name].refit.gain + second.gain):
            return None
        return replace(pair, alternatives=tuple(each for each in pair.alternatives if self._may_be_first(pair, each)))

    def _fit_pair(self, refit: Refit, further: Refit) -> Pair:
        """Two effects fitted together, and other finalists in place of the first."""
        taken = {refit.name, further.name}
        others = [each.refit for name, each in self.finalists.items() if name not in taken and each.refit.gain > 0]
        numbers = f"{refit.strength:.6g} and {further.strength:.6g}"
        return self.run_step(
            f"{refit.name} and {further.name} of {numbers} together",
            lambda: fit_pair(self.finalists[refit.name].arrangement, self.baseline, refit, further, others),
        )

    def _choose_first(self, pair: Pair) -> Finalist | None:
        """The most probable first effect of a pair; none if two at one place are far more probable than any others."""
        apart = [each for each in (pair.first, *pair.alternatives) if self._may_be_first(pair, each)]
        best = max(apart, key=lambda each: compute_log_density(each.refit), default=None)
        if best is None or compute_log_density(best.refit) < compute_log_density(pair.first.refit) - DECISIVE:
            return None
        return best

    def _may_be_first(self, pair: Pair, first: Finalist) -> bool:
        """Whether an effect passes beside the second one, at another place: two at one place are one force."""
        return passes(first.refit, self.thresholds) and not _share_place(first.refit, pair.second.refit)

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best effect, and others by falling probability until their sum is `CREDIBLE`."""
        ranked = self._rank(passed)
        shares = compute_probabilities(ranked).tolist()
        return ranked[: 1 + int(np.searchsorted(np.cumsum(shares), CREDIBLE))]

    def rank(self, passed: Sequence[Refit]) -> list[float]:
        """Probabilities of the best effect, and of all others that may be the true one, in the order of `choose`."""
        return list(compute_probabilities(self._rank(passed)).tolist())

    def _rank(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best of those that pass, then the others, the most probable first; of two effects those of the first."""
        if self.pair is not None:
            return [each.refit for each in self.pair.ranked]
        return [passed[0], *sorted(passed[1:], key=lambda each: -compute_log_density(each))]

    def is_unexplained(self) -> bool:
        """Whether an unknown force explains more than chance does."""
        if not self.places:
            return False
        left = compute_birge_ratio(self.baseline, self.places[0].gain)
        return compute_excess_gain(self.places[0]) - self.refuted > self.thresholds.misfit * left


def is_linear(effect: Effect, model: Model) -> bool:
    """Whether an effect changes no joint of a model, so that it acts alike at all amplitudes."""
    changed = effect.apply(model, [parameter.typical for parameter in effect.parameters])
    before, after = model.system.joints, changed.system.joints
    return len(before) == len(after) and all(one is other for one, other in zip(before, after, strict=True))


def takes_away(refit: Refit) -> bool:
    """Whether an effect takes a part away from the structure that the model has."""
    kind = None if refit.effect is None else find_kind(refit.effect)
    return kind is not None and kind.is_addition and refit.strength < 0


def _share_place(refit: Refit, other: Refit) -> bool:
    """Whether two effects act at one place."""
    places = [place_of(each.name) for each in (refit, other)]
    return bool(places[0]) and places[0] == places[1]


def place_of(name: str) -> str:
    """Place of an effect by its name; empty for one that acts at none."""
    return name.partition(" at ")[2]


def _stand_in(
    refit: Refit, baseline: Refit, residual: ResidualExplanation, thresholds: Thresholds, linear: bool
) -> bool:
    """Whether something else gains a good part of an effect's gain, or a linear one leaves what is no known one."""
    unknown = compute_excess_gain(residual.places[0]) - thresholds.misfit if residual.places else 0.0
    beyond = max(residual.gain - thresholds.gain, unknown)
    is_left = refit.reduced_chi2_by_noise > UNEXPLAINED
    if linear and unknown > 0 and residual.known_effect_gain < KNOWN * residual.places[0].gain and is_left:
        return True
    return beyond > STAND_IN * refit.gain and not _explains_nearly_all(refit, baseline)


def _explains_nearly_all(refit: Refit, baseline: Refit) -> bool:
    """Whether an effect leaves less than the share `STAND_IN` of an error that noise and stated errors do not explain.

    Without it, model error of the size of the responses may explain as much as the effect does, and gains are small.
    """
    was, left = baseline.reduced_chi2_by_noise, refit.reduced_chi2_by_noise
    return was > UNEXPLAINED and left - 1 < STAND_IN**2 * (was - left)
