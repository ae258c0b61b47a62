"""Effects that earlier rounds of a diagnosis added to the model."""

from dataclasses import dataclass

from diagnosis.candidate.effect import Effect
from diagnosis.fit.fit_parameter import Values


@dataclass(frozen=True, kw_only=True, eq=False)
class AddedEffect:
    """An effect added in an earlier round and its values, which are fitted again with everything else."""

    effect: Effect
    values: Values
