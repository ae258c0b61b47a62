"""One parameter of a joint's law differs from that of the case: a bolt is tighter, a lap has less contact area.

Parameters that define the form of the law, such as exponents, are not changed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.joint_parameter import find_factor_bounds, find_joints, find_size, scale_joints
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "joint parameter"
TYPICAL = 1.1


@dataclass(frozen=True, kw_only=True, eq=False)
class JointParameter:
    """Scales one parameter of the joints of a group; it has the name of the equivalent calibration parameter.

    Parameters
    ----------
    group
        One of `Model.joint_groups`.
    key
        Parameter of the law.
    """

    name: str
    group: str
    key: str
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = (
        "A joint is stiffer, slips at another force or dissipates more than in the case: bolt force, wear, real "
        "contact area."
    )
    signature: str = (
        "A stiffness: resonance frequencies differ at all levels. A limit force: slip begins at another level, and "
        "frequency and damping change with the level as if all levels were multiplied by a factor."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The parameter times the ratio."""
        (ratio,) = values
        return scale_joints(model, self.group, self.key, ratio)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """Each parameter of each group of joints, except those that define the form of the law."""
    del size
    if not model.joint_groups:
        return [Untestable(name=KIND, reason="the model has no joints besides its contact lines")]
    result: list[Effect | Untestable] = []
    for group in model.joint_groups:
        joints = find_joints(model, group)
        if not joints:
            result.append(Untestable(name=f"{KIND} of {group}", reason="the model has no joint of this name"))
            continue
        for parameter in joints[0].parameters:
            name = f"{group}.{parameter.name}"
            if parameter.is_form:
                continue
            if not find_size(joints, parameter.name):
                result.append(Untestable(name=name, reason="it is zero in the model, and a ratio cannot change zero"))
                continue
            lower, upper = find_factor_bounds(joints, parameter.name)
            ratio = EffectParameter(
                name="ratio", unit="-", lower=lower, upper=upper, typical=min(TYPICAL, upper), vanishes=1.0
            )
            result.append(JointParameter(name=name, group=group, key=parameter.name, parameters=(ratio,)))
    return result


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="joints that belong to no line", physics=JointParameter.physics,
        signature=JointParameter.signature, parameters={"ratio": ("-",)}, candidates=candidates, order=13,
        acts_by_slip_alone=True,
    )
)  # fmt: skip
