"""One effect, or none, that was fitted beside the accepted parameters: how strong it is, and how surely."""

from dataclasses import dataclass
from typing import Protocol

from diagnosis.effect.candidate import Effect
from diagnosis.fit.unknowns import Values


class Fitted(Protocol):
    """Numbers with their standard deviations; those of the effect come last."""

    @property
    def values(self) -> Values:
        """Shape (p,)."""
        ...

    @property
    def deviation(self) -> Values:
        """Shape (p,)."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class OneEffect:
    """An effect and a fit with it.

    Parameters
    ----------
    effect
        None for what every fit has, alone.
    fit
        Of the training data.
    """

    effect: Effect | None
    fit: Fitted

    @property
    def name(self) -> str:
        """Of the effect; "nothing" without any."""
        return "nothing" if self.effect is None else self.effect.name

    @property
    def strength(self) -> float:
        """Of the effect [its unit]."""
        return float(self.fit.values[self._first]) if self.effect is not None else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the strength [its unit]."""
        return float(self.fit.deviation[self._first]) if self.effect is not None else 0.0

    @property
    def _first(self) -> int:
        return len(self.fit.values) - len(self.effect.parameters if self.effect is not None else ())
