"""One contact line is pressed more or less than modelled."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.test_model import TestModel
from diagnosis.effect.candidate import Effect, EffectParameter, Untestable
from diagnosis.effect.contact_line import contacts
from diagnosis.effect.scale import Scale

KIND = "pre-load"
RATIO = EffectParameter(name="pre-load ratio", unit="-", lower=0.1, upper=3.0, typical=1.1, vanishes=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Preload:
    """Scales the pre-load of a line, and the static load that balances it, so that rest stays rest."""

    name: str
    line: str
    parameters: tuple[EffectParameter, ...] = (RATIO,)
    kind: str = KIND
    physics: str = "The contact line is pressed with another force at rest: bolts, dead weights, assembly."
    signature: str = (
        "The line's mean normal force is off at all levels; slip and lift-off begin at another level, so that its "
        "tangential force saturates elsewhere; nothing without contacts."
    )

    def apply(self, test_model: TestModel, values: Sequence[float]) -> TestModel:
        """N_0 of each contact times the ratio; the static load rises by what N_0 rises, along the normal."""
        (ratio,) = values
        static, change = test_model.system.static, {}
        for contact in contacts(test_model, self.line):
            static = static + (ratio - 1) * contact.preload * contact.normal
            change[contact.name] = {"preload": ratio * contact.preload}
        return test_model.with_joints(change).with_system(static_load=static)


def candidates(test_model: TestModel, size: Scale | None = None) -> list[Effect | Untestable]:
    """The pre-load of each line.

    Parameters
    ----------
    test_model
        Whose lines.
    size
        Of the model; not asked for.
    """
    del size
    if not test_model.lines:
        return [Untestable(name=KIND, reason="the model has no contact lines")]
    found: list[Effect | Untestable] = []
    for line in test_model.lines:
        name = f"{KIND} of {line}"
        if any(contact.preload for contact in contacts(test_model, line)):
            found.append(Preload(name=name, line=line))
        else:
            found.append(Untestable(name=name, reason="it is zero in the model, and a ratio leaves it so"))
    return found
