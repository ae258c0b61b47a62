"""The gate of steady states: gains compared with what chance gives, in training and held-out data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.decision.closeness import list_held_back
from diagnosis.decision.evidence import (
    DECISIVE,
    compute_probabilities,
    compute_spread,
    compute_stated,
    gains,
    passes,
    support,
)
from diagnosis.decision.law_of_force import FittedLaw, find_better, find_rivals, fit_other_laws, has_other_laws
from diagnosis.decision.leftover import Leftover, find_leftover, with_effect
from diagnosis.decision.pair import Pair, fit_pair
from diagnosis.effect import EFFECTS
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED, Refit
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce, misfit

#: Probability that one of the effects that are named is the true one, if one of those that pass is.
CREDIBLE = 0.95
#: Share of the gain of the best effect that others may gain beyond the threshold, and of the error that it may leave.
STAND_IN = 0.15
#: Rise of a relative error that is none: an effect on forces moves it, too [-].
ERROR_ROUNDED = 0.01
#: Share of the gain of an unknown force beside the best effect from which on a known one explains it, to first order as
#: well: it is then the next effect to be named.
KNOWN = 0.5


@dataclass(frozen=True, eq=False)
class ChanceGate:
    """Gains compared with the detection thresholds, in training and held-out data."""

    finalists: Mapping[str, Finalist]
    """Effects that were fitted to the end, by name."""
    catalogue: Catalogue
    places: Sequence[UnknownForce]
    thresholds: Thresholds
    run_step: RunStep
    before: Refit
    refuted: float
    """Largest gain of an effect that the held-out data speak against: a force that gains no more is as wrong."""
    left: dict[str, Leftover] = field(default_factory=dict)
    """What is left beside effects that were asked for, by name."""
    pairs: list[Pair] = field(default_factory=list)
    """Two effects, one of them asked for, that are missing together."""
    instead: list[Finalist] = field(default_factory=list)
    """Effects that explain alone what they and the one that was asked for explain together."""
    fitted: dict[str, list[FittedLaw]] = field(default_factory=dict)
    """Laws that were fitted in place of those of effects, by the names of these."""
    laws: dict[str, FittedLaw] = field(default_factory=dict)
    """Laws that forces turned out to have in place of those of effects, by the names of these."""

    @property
    def pair(self) -> Pair | None:
        """The effect that was asked for, and one that is missing as well."""
        return next(iter(self.pairs), None)

    def passes(self, refit: Refit) -> bool:
        """Whether an effect is significant."""
        return passes(refit, self.thresholds)

    def explains(self, refit: Refit) -> bool:
        """Whether an effect leaves little enough, alone or with a further one, and has the law of its force."""
        law = self._find_another_law(refit)
        if law is not None:
            self.laws[refit.name] = law
            return False
        rest = self._find_leftover(refit)
        assert refit.effect is not None
        linear = is_linear(refit.effect, self.finalists[refit.name].arrangement.fit.model)
        stands_in = _stand_in(refit, self.before, rest, self.thresholds, linear)
        return not stands_in or self._explains_with(refit, rest.further)

    def find_first_of_two(self, refits: Sequence[Refit]) -> Refit | None:
        """The best effect that gains, if the held-out data refute it alone, and speak for it with a further one.

        Both leave no more than noise and stated errors explain: what each alone leaves is why either was refuted.
        """
        first = max((each for each in refits if gains(each, self.thresholds)), key=support, default=None)
        if first is None or self._find_another_law(first) is not None:
            return None
        further = self._find_leftover(first).further
        if further is None or compute_stated(further) > UNEXPLAINED:
            return None
        if not self._explains_with(first, further) or self.pair is None:
            return None
        second = self.pair.second.refit
        speak_for = first.held_gain + second.held_gain >= DECISIVE and not self._rises(second)
        return first if speak_for else None

    def _find_leftover(self, refit: Refit) -> Leftover:
        """What an effect leaves."""
        if refit.name not in self.left:
            others = [each for each in self.catalogue.candidates if each.name != refit.name]
            limit = self.thresholds.gain
            self.left[refit.name] = self.run_step(
                f"what is left beside {refit.name}, limit {limit:.6g}",
                lambda: find_leftover(with_effect(self.finalists[refit.name].arrangement, refit), others, limit),
            )
        return self.left[refit.name]

    def _fit_other_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the force of an effect may have instead, fitted."""
        if not has_other_laws(refit.effect):
            return []
        if refit.name not in self.fitted:
            arrangement = self.finalists[refit.name].arrangement
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
        """Whether the held-out data speak for an effect, or for it and the one that is missing as well.

        They do by their density, if neither their misfit by noise and stated errors rises, nor their relative error
        where noise does not explain it; and of nothing that takes mass or stiffness away, as errors of a model do, or
        that needs a calibration parameter at the end of its prior.
        """
        both = [refit] if self.pair is None else [refit, self.pair.second.refit]
        held_gain = self.finalists[refit.name].refit.held_gain + sum(each.held_gain for each in both[1:])
        strained = list_held_back(refit.fit) or any(map(takes_away, both))
        return bool(held_gain >= DECISIVE and not self._rises(refit) and not strained)

    def _rises(self, refit: Refit) -> bool:
        """Whether held-out data are further off with an effect; chi^2 within a standard deviation is noise."""
        if refit.held_misfit <= 1 + np.sqrt(2 / max(refit.n_held, 1)):
            return False
        larger = refit.held_error > (1 + ERROR_ROUNDED) * self.before.held_error
        return bool(larger or refit.held_misfit > self.before.held_misfit)

    def find_rival_laws(self, refit: Refit) -> list[FittedLaw]:
        """Laws that the data do not refute in place of that of an effect."""
        return find_rivals(self._fit_other_laws(self.finalists[refit.name].refit), DECISIVE)

    def generalises_by_another_law(self, refits: Sequence[Refit]) -> bool:
        """Whether the best effect that gains lowers the held-out error by another law of its force alone."""
        refit = next((each for each in refits if gains(each, self.thresholds)), None)
        law = None if refit is None else self._find_another_law(refit)
        if refit is None or law is None:
            return False
        if not (refit.held_gain + law.held_gain > 0 and law.refit.held_error < self.before.held_error):
            return False
        self.laws[refit.name] = law
        return True

    def _explains_with(self, refit: Refit, further: Refit | None) -> bool:
        """Whether an effect and a further one explain together what either does not."""
        if further is None or not passes(further, self.thresholds):
            return False
        taken = {refit.name, further.name}
        others = [each.refit for name, each in self.finalists.items() if name not in taken and each.refit.gain > 0]
        pair = self.run_step(
            f"{refit.name} and {further.name} together",
            lambda: fit_pair(self.finalists[refit.name].arrangement, self.before, refit, further, others),
        )
        if not passes(pair.first.refit, self.thresholds):
            self.instead.append(pair.alone)
            return False
        second, force = pair.second.refit, pair.force - self.thresholds.misfit
        if not passes(second, self.thresholds) or force > STAND_IN * (refit.gain + second.gain):
            return False
        best = support(pair.ranked[0].refit)
        if all(_share_place(each.refit, second) for each in pair.ranked if support(each.refit) > best - DECISIVE):
            return False
        self.pairs.append(pair)
        return True

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best effect, and others until one of them is the true one with the probability `CREDIBLE`."""
        ranked = self.rank(passed[0])
        by_name = self.finalists if self.pair is None else {each.name: each for each in self.pair.ranked}
        count = 1 + int(np.searchsorted(np.cumsum([*ranked.values()]), CREDIBLE))
        return [by_name[name].refit for name in ranked][:count]

    def rank(self, best: Refit) -> dict[str, float]:
        """Probabilities by name: of the best effect, then of all others that pass, the largest first.

        With a further effect, the best ones are those that explain most beside that.
        """
        if self.pair is not None:
            ranked = [each.refit for each in self.pair.ranked]
        else:
            passing = [each.refit for each in self.finalists.values() if self.passes(each.refit)]
            ranked = [best, *sorted((each for each in passing if each is not best), key=lambda each: -support(each))]
        return {each.name: share for each, share in zip(ranked, compute_probabilities(ranked).tolist(), strict=True)}

    def is_unexplained(self) -> bool:
        """Whether an unknown force explains more than chance does."""
        if not self.places:
            return False
        left = compute_spread(self.before, self.places[0].gain)
        return misfit(self.places[0]) - self.refuted > self.thresholds.misfit * left


def is_linear(effect: Effect, model: Model) -> bool:
    """Whether an effect changes no joint of a model, so that it acts alike at all amplitudes."""
    changed = effect.apply(model, [parameter.typical for parameter in effect.parameters])
    before, after = model.system.joints, changed.system.joints
    return len(before) == len(after) and all(one is other for one, other in zip(before, after, strict=True))


def takes_away(refit: Refit) -> bool:
    """Whether an effect takes a part away from the structure that the model has."""
    kinds = {kind.name for kind in EFFECTS if kind.is_addition}
    return refit.effect is not None and refit.effect.kind in kinds and refit.strength < 0


def _share_place(refit: Refit, other: Refit) -> bool:
    """Whether two effects act at one place."""
    places = [place_of(each.name) for each in (refit, other)]
    return bool(places[0]) and places[0] == places[1]


def place_of(name: str) -> str:
    """Place of an effect by its name; empty for one that acts at none."""
    return name.partition(" at ")[2]


def _stand_in(refit: Refit, before: Refit, rest: Leftover, thresholds: Thresholds, linear: bool) -> bool:
    """Whether something else gains a good part of an effect's gain, or a linear one leaves what is no known one."""
    unknown = misfit(rest.places[0]) - thresholds.misfit if rest.places else 0.0
    beyond = max(rest.gain - thresholds.gain, unknown)
    is_left = compute_stated(refit) > UNEXPLAINED
    if linear and unknown > 0 and rest.known < KNOWN * rest.places[0].gain and is_left:
        return True
    return beyond > STAND_IN * refit.gain and not _explains_nearly_all(refit, before)


def _explains_nearly_all(refit: Refit, before: Refit) -> bool:
    """Whether an effect leaves less than the share `STAND_IN` of an error that noise and stated errors do not explain.

    Without it, model error of the size of the responses may explain as much as the effect does, and gains are small.
    """
    was, left = compute_stated(before), compute_stated(refit)
    return was > UNEXPLAINED and left - 1 < STAND_IN**2 * (was - left)
