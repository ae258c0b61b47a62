"""Effects on one contact line relative to the others: a scaled property of its contacts."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EffectKind
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import FrictionContact


def find_contacts(model: Model, line: str) -> list[FrictionContact]:
    """Contacts of a line, in order along it; none in a configuration without the line."""
    members = model.lines.get(line, ())
    result = {contact.name: contact for contact in list_friction_contacts(model.system.joints)}
    return [result[name] for name in members]


def scale_contacts(model: Model, factor: dict[str, float], quantity: str) -> Model:
    """Model with a property of the contacts times a factor for each line."""
    return model.with_joints(
        {
            contact.name: {quantity: value * getattr(contact, quantity)}
            for line, value in factor.items()
            for contact in find_contacts(model, line)
        }
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class LineRatio:
    """A property of a line times a ratio; of two lines, one times and the other divided by the root of the ratio.

    Parameters
    ----------
    line, other
        Line that is scaled up, and line that is scaled down ("" for none).
    quantity
        Scaled field of `FrictionContact`.
    """

    name: str
    kind: str
    physics: str
    signature: str
    line: str
    quantity: str
    parameters: tuple[EffectParameter, ...]
    other: str = ""

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with scaled contacts."""
        (ratio,) = values
        factor = {self.line: sqrt(ratio), self.other: 1 / sqrt(ratio)} if self.other else {self.line: ratio}
        return scale_contacts(model, factor, self.quantity)


def make_line_ratio_kind(name: str, quantity: str, *, physics: str, signature: str, **facts: Any) -> EffectKind:
    """Kind of the ratios of one field of `FrictionContact` between lines; `facts` as for `EffectKind`."""

    def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
        del size
        return _list_line_ratios(model, kind=name, quantity=quantity, physics=physics, signature=signature)

    return EffectKind(
        name=name, acts_on="contact lines", physics=physics, signature=signature, parameters={"ratio": ("-",)},
        candidates=candidates, **facts,
    )  # fmt: skip


def _list_line_ratios(
    model: Model, *, kind: str, quantity: str, physics: str, signature: str
) -> list[Effect | Untestable]:
    """Effects on a property of each line relative to the others; of two lines, their ratio.

    The common value of all lines is a calibration parameter. Two lines therefore have a single effect, their ratio,
    which does not change their geometric mean.
    """
    lines = list(model.lines)
    if not lines:
        return [Untestable(name=kind, reason="the model has no contact lines")]
    if len(lines) == 1:
        reason = f"the model has only one contact line: its {kind} is calibrated"
        return [Untestable(name=f"{kind} of {lines[0]}", reason=reason)]
    parameter = EffectParameter(name="ratio", unit="-", lower=0.2, upper=5.0, typical=1.1, vanishes=1.0)
    pairs = [(lines[0], lines[1])] if len(lines) == 2 else [(line, "") for line in lines]
    result: list[Effect | Untestable] = []
    for line, other in pairs:
        name = f"{kind} of {line}" + (f" against {other}" if other else "")
        if not any(getattr(contact, quantity) for item in (line, other) for contact in find_contacts(model, item)):
            result.append(Untestable(name=name, reason="it is zero in the model, and a ratio cannot change zero"))
            continue
        effect = LineRatio(
            name=name, kind=kind, physics=physics, signature=signature, line=line, other=other, quantity=quantity,
            parameters=(parameter,),
        )  # fmt: skip
        result.append(effect)
    return result
