"""Fitted models that a verdict leaves open, with their probabilities."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.decision.evidence import CREDIBLE, DECISIVE, compute_probabilities
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.calibration import Fit
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.problem import Refit
from diagnosis.missing_law.curves import draw_coefficients
from diagnosis.missing_law.law_joints import list_law_joints
from diagnosis.missing_law.place_law import MissingLaw, PlaceLaw
from reduction.jointed_system import Joint

#: Largest number of models that are compared, and least probability of a model [-].
MAX_MODELS, MIN_PROBABILITY = 4, 1e-3
#: Number of draws of a recovered law that represent the uncertainty of its forces.
LAW_DRAWS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateModel:
    """A fitted model.

    Parameters
    ----------
    name
        Name of the effects or law of the model.
    probability
        Probability, given that one of the candidates is true [-].
    unknowns, fit_values, covariance
        Parameters, their values, shape (p,), and their covariance by the present data, shape (p, p).
    model
        The model with these values.
    draws
        Draws of the model, for an uncertainty that the parameters do not describe.
    curvature_pair
        Models one standard deviation up and down along the most uncertain direction of the parameters. The difference
        of their mean from this model is the curvature of the predictions. None if it is not needed.
    """

    name: str
    probability: float
    unknowns: Unknowns
    fit_values: Float[NDArray[np.float64], " p"]
    covariance: Float[NDArray[np.float64], "p p"]
    model: Model
    draws: tuple[Model, ...] = ()
    curvature_pair: tuple[Model, Model] | None = None

    @property
    def root(self) -> Float[NDArray[np.float64], "p p"]:
        """Square root of the covariance, one column per independent change of the parameters, shape (p, p)."""
        size = self.unknowns.size
        scaled, turn = np.linalg.eigh(self.covariance / np.outer(size, size))
        return np.asarray(size[:, None] * turn * np.sqrt(np.maximum(scaled, 0.0)))


def list_candidate_models(verdict: Verdict, law: MissingLaw | None = None) -> list[CandidateModel]:
    """Models that a verdict leaves open, most probable first; fewer than two if there is nothing to separate.

    Parameters
    ----------
    verdict
        With several effects: these and the other laws of the first one; with a single unconfirmed effect: this effect
        and no effect; with an unknown cause: the places of its law.
    law
        Recovered law of an unknown force.
    """
    if verdict.finding is Finding.AMBIGUOUS:
        return _weigh(_list_effects(verdict))
    if verdict.finding is Finding.UNKNOWN and law is not None:
        result = zip(law.places, law.probability.tolist(), strict=True)
        return _weigh(
            [_of_law(item, share, verdict.baseline.fit) for item, share in result if item.name in law.credible]
        )
    return []


def _list_effects(verdict: Verdict) -> list[CandidateModel]:
    if len(verdict.effects) == 1 and verdict.further is not None and verdict.further_alternatives:
        # The first effect is certain: a test separates those that may be the second one.
        seconds = [verdict.further, *verdict.further_alternatives]
        known = compute_probabilities(seconds).tolist()
        return [_of_refit(item, share) for item, share in zip(seconds, known, strict=True)]
    shares = [*verdict.probabilities] or [1.0] * len(verdict.effects)
    if len(shares) > 1 and max(shares) >= CREDIBLE:
        # The held-out data contradict the effect that the densities prefer: neither decides.
        shares = [1.0] * len(shares)
    result = [_of_refit(item, share) for item, share in zip(verdict.effects, shares, strict=True)]
    # If there are two effects, other laws of the first one were fitted without the second one: leave them out.
    for other in verdict.laws if verdict.further is None else ():
        # The law is an alternative to the first effect: its odds follow from the densities of both.
        odds = float(np.exp(np.clip(other.whole_gain, -2 * DECISIVE, 2 * DECISIVE) / 2))
        result.append(_of_refit(other.refit, shares[0] * odds, other.words))
    if len(result) == 1:
        odds = float(np.exp(-np.clip(verdict.effects[0].held_out_gain, 0.0, DECISIVE) / 2))
        result.append(_of_refit(verdict.baseline, odds, f"no {result[0].name}"))
    return result


def _weigh(models: list[CandidateModel]) -> list[CandidateModel]:
    whole = sum(item.probability for item in models)
    ranked = sorted((replace(item, probability=item.probability / whole) for item in models), key=_improbable)
    kept = [item for item in ranked if item.probability >= MIN_PROBABILITY][:MAX_MODELS]
    whole = sum(item.probability for item in kept)
    return [replace(item, probability=item.probability / whole) for item in kept]


def _improbable(candidate: CandidateModel) -> float:
    return -candidate.probability


def _of_refit(refit: Refit, probability: float, name: str = "") -> CandidateModel:
    fit = refit.fit
    result = CandidateModel(
        name=name or refit.label, probability=probability, unknowns=fit.unknowns, fit_values=fit.values,
        covariance=fit.covariance, model=fit.model,
    )  # fmt: skip
    root = result.root
    along = root[:, int(np.argmax(np.linalg.norm(root / fit.unknowns.size[:, None], axis=0)))]
    up, down = (fit.unknowns.compose(fit.unknowns.clipped(fit.values + side * along)) for side in (1.0, -1.0))
    return replace(result, curvature_pair=(up, down))


def _of_law(law: PlaceLaw, probability: float, fit: Fit) -> CandidateModel:
    """The model with a law; the covariance of its calibration parameters is that without the law."""
    base = fit.unknowns.compose(law.values)

    def insert(coefficients: Float[NDArray[np.float64], " b"]) -> Model:
        own = list_law_joints(f"law at {law.name}", law.row, law.basis, coefficients)
        return base.with_system(joints=[*base.system.joints, *own])

    model = insert(law.posterior.mean)
    draws = tuple(insert(item) for item in draw_coefficients(law, LAW_DRAWS))
    added = tuple(model.system.joints[len(base.system.joints) :])
    unknowns = replace(fit.unknowns, base=_with_joints(fit.unknowns.base, added))
    return CandidateModel(
        name=f"a law at {law.name}", probability=probability, unknowns=unknowns, fit_values=law.values,
        covariance=fit.covariance, model=model, draws=draws,
    )  # fmt: skip


def _with_joints(model: Model, joints: tuple[Joint, ...]) -> Model:
    return model.with_system(joints=[*model.system.joints, *joints])
