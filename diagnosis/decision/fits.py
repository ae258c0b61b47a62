"""Fits from which a verdict is derived: those of the finalists, and further ones that the rules request."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from scipy.special import chdtri

from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.evidence import compute_birge_ratio
from diagnosis.decision.law_of_force import (
    FittedLaw,
    compute_law_density,
    find_better,
    fit_by_own_covariance,
    fit_other_laws,
    has_other_laws,
)
from diagnosis.decision.pair import Pair, fit_pair, fit_seconds
from diagnosis.decision.residual_explanation import ResidualExplanation, add_effect, explain_residual
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Vector
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Fits of a round.

    Parameters
    ----------
    baseline
        Fit without an effect.
    beyond_priors
        Calibration parameters of `baseline` beyond their priors.
    places
        Places where an unknown force would explain the residual of `baseline`, best first.
    finalists
        Effects, each fitted with its own covariance, by name, best first.
    catalogue, thresholds
        Candidates and detection thresholds.
    directions
        Change of the data by each visible candidate, calibration parameters projected out, by its name: a unit vector,
        shape (m + p,).
    run_step
        Looks up the stored result of a step, or computes it.
    refit_by_own_covariance
        Refits an effect with the covariance of its own model; None if this is not possible.
    """

    baseline: Refit
    beyond_priors: Sequence[str]
    places: Sequence[UnknownForce]
    finalists: Mapping[str, Finalist]
    catalogue: Catalogue
    thresholds: Thresholds
    directions: Mapping[str, Vector]
    run_step: RunStep
    refit_by_own_covariance: Callable[[Comparison, Refit], Finalist] | None = None

    @property
    def refits(self) -> list[Refit]:
        """Fits of the finalists, the best first."""
        return [item.refit for item in self.finalists.values()]

    def arrangement_of(self, refit: Refit) -> Arrangement:
        """Arrangement with the covariance of the last fit of this effect, usually that of its own model."""
        return self.finalists[refit.name].arrangement

    def explain_residual(self, refit: Refit) -> ResidualExplanation:
        """Further effects and unknown forces that would explain the residual after an effect."""
        others = [item for item in self.catalogue.candidates if item.name != refit.name]
        limit = self.thresholds.gain
        return self.run_step(
            f"what is left beside {refit.name} of {refit.strength:.6g}, limit {limit:.6g}",
            lambda: explain_residual(add_effect(self.arrangement_of(refit), refit), others, limit),
        )

    def fit_other_laws(self, refit: Refit) -> list[FittedLaw]:
        """Fits of the other laws that the force of an effect may have; empty if its kind has none.

        The law with the smallest residual is also fitted with the covariance of its own model, if it gains with that of
        the effect, or if noise and stated errors do not explain the residual after the effect.
        """
        if not has_other_laws(refit.effect):
            return []
        arrangement = self.arrangement_of(refit)
        laws = self.run_step(
            f"other laws of {refit.name} of {refit.strength:.6g}",
            lambda: fit_other_laws(arrangement, add_effect(arrangement, refit).cost, refit),
        )
        least = min((law for law in laws if law.is_distinct), key=lambda law: law.chi2_by_noise, default=None)
        # A finer model has no law of this name.
        if self.refit_by_own_covariance is None or arrangement.finer or least is None:
            return laws
        leaves_much = refit.reduced_chi2_by_noise > max(UNEXPLAINED_CHI2, least.refit.reduced_chi2_by_noise)
        if least.whole_gain <= 0 and not leaves_much:
            return laws
        own = self.run_step(
            f"{least.refit.name} of {refit.strength:.6g} by its own covariance",
            partial(fit_by_own_covariance, least, arrangement, refit, self.refit_by_own_covariance),
        )
        return [*(law for law in laws if law is not least), own]

    def find_better_law(self, refit: Refit) -> FittedLaw | None:
        """Another law of the force that is better than that of the effect by more than chance; None without one."""
        chance = float(chdtri(1, self.thresholds.false_alarms)) * compute_birge_ratio(refit)
        return find_better(self.fit_other_laws(refit), chance)

    def find_best_law(self, refits: Sequence[Refit]) -> tuple[Refit, FittedLaw] | None:
        """Effect and better law with the highest density of all data among some effects; None if no law is better.

        All effects are tried, since the right effect with the wrong law may fit worse than others.
        """
        laws = [(refit, law) for refit in refits if (law := self.find_better_law(refit)) is not None]
        return max(laws, key=lambda item: compute_law_density(*item), default=None)

    def fit_pair(self, refit: Refit, further: Refit) -> Pair:
        """Joint fit of two effects, and fits with other finalists instead of the first."""
        others = self._list_gaining(without={refit.name, further.name})
        numbers = f"{refit.strength:.6g} and {further.strength:.6g}"
        return self.run_step(
            f"{refit.name} and {further.name} of {numbers} together",
            lambda: fit_pair(self.arrangement_of(refit), self.baseline, refit, further, others),
        )

    def fit_seconds(self, pair: Pair, further: Sequence[Refit]) -> list[Finalist]:
        """Fits with the first effect of a pair and its second one, or further effects or other finalists instead."""
        first, second = self.finalists[pair.first.name].refit, pair.second.refit
        listed = {item.name: item for item in (*self._list_gaining(without=()), *further)}
        others = [item for name, item in listed.items() if name not in {first.name, second.name}]
        return self.run_step(
            f"{first.name} with others than {second.name} of {first.strength:.6g} and {second.strength:.6g}",
            lambda: fit_seconds(self.arrangement_of(first), first, pair, others),
        )

    def _list_gaining(self, without: Collection[str]) -> list[Refit]:
        """Finalists that gain, without some of them by name."""
        return [item.refit for name, item in self.finalists.items() if name not in without and item.refit.gain > 0]
