"""Models that a verdict leaves open, each fitted, with its probability."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.decision.evidence import CREDIBLE, DECISIVE
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.calibration import Fit
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.problem import Refit
from diagnosis.missing_law.curves import draw_coefficients
from diagnosis.missing_law.law_joints import list_law_joints
from diagnosis.missing_law.place_law import MissingLaw, PlaceLaw
from reduction.jointed_system import Joint

#: Models that are compared at most, and the least probability of one beside the best [-].
MAX_MODELS, MIN_PROBABILITY = 4, 1e-3
#: Draws of a recovered law that tell how uncertain its forces are.
LAW_DRAWS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateModel:
    """A fitted model.

    Parameters
    ----------
    name
        Name of what it has beside the calibration.
    probability
        Probability, if one of all candidates is true [-].
    unknowns, fit_values, covariance
        Parameters, their values, shape (p,), and their covariance by the data so far, shape (p, p).
    model
        The model with these values.
    draws
        Other models that are as probable, for what parameters do not describe.
    curvature_pair
        Models a standard deviation up and down along the direction of the parameters that is known least: the
        difference of their mean from this one is the curvature of the predictions. None where they are linear.
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
    """Models that a verdict leaves open, the most probable first; fewer than two if it leaves nothing to separate.

    Parameters
    ----------
    verdict
        Of several effects, those and the other laws of the first one; of an effect that is named alone but not
        confirmed, it and none. Of something unknown, the places of its law.
    law
        Recovered law of what is unknown.
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
    shares = [*verdict.probabilities] or [1.0] * len(verdict.effects)
    if len(shares) > 1 and max(shares) >= CREDIBLE:
        # The held-out data object to the one that the densities prefer: neither decides.
        shares = [1.0] * len(shares)
    result = [_of_refit(item, share) for item, share in zip(verdict.effects, shares, strict=True)]
    # A law that was fitted in place of the first of two effects was fitted without the second one.
    for other in verdict.laws if verdict.further is None else ():
        # It is an alternative to the first effect: its odds follow from the densities of both.
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
    """The model with a law in it; its calibration parameters are as uncertain as they are without."""
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
