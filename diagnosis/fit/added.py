"""Effects that earlier rounds of a diagnosis added to the model."""

from dataclasses import dataclass, replace

from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect, EffectError
from diagnosis.fit.fit_parameter import Values


@dataclass(frozen=True, kw_only=True, eq=False)
class AddedEffect:
    """An effect added in an earlier round and its values, which are fitted again with everything else."""

    effect: Effect
    values: Values

    def listed_in(self, catalogue: Catalogue) -> "AddedEffect":
        """The same with typical size and bounds from a catalogue; these depend on the levels of the data.

        Raises
        ------
        EffectError
            A value is outside these bounds, so that a fit would change it.
        """
        try:
            effect = catalogue.effect(self.effect.name)
        except EffectError:
            return self  # The data contain no information about this effect, but the model has it.
        for parameter, value in zip(effect.parameters, self.values, strict=True):
            if not parameter.lower <= value <= parameter.upper:
                unit = parameter.unit.replace("-", "")
                raise EffectError(
                    f'[[added]] effect "{effect.name}": {parameter.name} = {value:.6g} {unit}'.rstrip()
                    + f" is outside the bounds of a fit to these data, {parameter.lower:.4g} to {parameter.upper:.4g}: "
                    "give a value between them, or make it a [[joint]] of the case"
                )
        return replace(self, effect=effect)
