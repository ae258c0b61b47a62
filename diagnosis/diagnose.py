"""One round of diagnosis: what is missing from a model, nothing, one of several, or nothing that is known."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from correlation.measurement import Campaign
from correlation.nuisance import Budget
from correlation.test_model import TestModel
from diagnosis.accepted import Accepted
from diagnosis.arrangement import Arrangement, arrange
from diagnosis.catalogue import Catalogue, Extra, catalogue
from diagnosis.effect.candidate import Effect
from diagnosis.limits import Limits
from diagnosis.localisation import Place, localise
from diagnosis.refit import Refit, refit, shortlist, unchanged
from diagnosis.screening import Score, screen
from diagnosis.unknowns import Values
from diagnosis.verdict import Verdict

T = TypeVar("T")
#: What is being done, and the share of the whole diagnosis that is done [-].
Report = Callable[[str, float], None]


class Keep(Protocol):
    """Looks up what a step gave before, or makes it."""

    def __call__(self, name: str, make: Callable[[], T]) -> T:
        """The result of a step by its name; `make` computes it."""
        ...


def computed(name: str, make: Callable[[], T]) -> T:  # noqa: ARG001  # the signature of Keep
    """Keep nothing."""
    return make()


@dataclass(frozen=True, kw_only=True, eq=False)
class Added:
    """An effect that was added before, and its values, which are fitted again with everything else."""

    effect: Effect
    values: Values


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """What one round found.

    Parameters
    ----------
    arrangement
        Measurements, covariance, and the accepted parameters (and added effects) fitted.
    catalogue
        Candidates, and what cannot be tested.
    scores
        Of all candidates, best first.
    before
        The model as it is, fitted and tested on the held-out data.
    refits
        The shortlist fitted in earnest, best first.
    places
        Where an unknown force would explain the residual, best first.
    limits
        What chance may do.
    verdict
        In words, with numbers.
    """

    arrangement: Arrangement
    catalogue: Catalogue
    scores: tuple[Score, ...]
    before: Refit
    refits: tuple[Refit, ...]
    places: tuple[Place, ...]
    limits: Limits
    verdict: Verdict


def diagnose(
    campaign: Campaign,
    base: TestModel,
    accepted: Sequence[Accepted],
    budget: Budget,
    *,
    added: Sequence[Added] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    limits: Limits | None = None,
    keep: Keep = computed,
    report: Report | None = None,
) -> Diagnosis:
    """Say what is missing."""
    raise NotImplementedError
