"""Calibration parameters of one line, joint or part: a factor on one of its values.

Their names are those of the case, such as "wall.friction_coefficient" or "lap.limit_force". Unlike the parameters
common to all contacts, they are calibrated only if a case accepts them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from correlation.model import LoadCell, Model
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.joint_parameter import find_factor_bounds, find_joints, find_size, scale_joints
from diagnosis.effect.density import Density
from diagnosis.fit.calibration_parameter import BOUNDS, CalibrationParameter, make_factor
from reduction.joint_law.registry import Joint

#: Values of a line and of a part that may be calibrated.
OF_LINE = ("tangential_stiffness", "normal_stiffness", "friction_coefficient")
OF_PART = ("E", "density")


@dataclass(frozen=True, kw_only=True, eq=False)
class ScopedParameter(CalibrationParameter):
    """A factor on one value of a line, a joint or a part.

    Parameters
    ----------
    owner
        Name of the line, joint or part.
    key
        Name of the value.
    """

    owner: str
    key: str

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the factor; a test without contacts is unchanged if the owner is a line."""
        (factor,) = values
        if self.owner in model.lines:
            return scale_contacts(model, {self.owner: factor}, self.key)
        if self.owner in model.joint_groups:
            return scale_joints(model, self.owner, self.key, factor)
        if self.key == "density":
            return Density(name=self.name, part=self.owner).apply(model, values)
        (part,) = (part for part in model.parts if part.name == self.owner)
        if self.owner in model.elastic_bodies:
            return model.with_elastic_body(self.owner, model.elastic_bodies[self.owner].scale_stiffness(factor))
        return model.with_material(model.system.mass, model.system.stiffness + (factor - 1) * part.stiffness)


def make_scoped_parameter(model: Model, name: str, deviation: float) -> ScopedParameter:
    """A calibration parameter by its name.

    Parameters
    ----------
    model
        Model.
    name
        Line, joint or part, a dot, and the name of the value.
    deviation
        Standard deviation of the prior of the factor around 1 [-].

    Raises
    ------
    EffectError
        The model has no such value, or it is zero, or it cannot be scaled, separately or at all.
    """
    owner, _, key = name.rpartition(".")
    joints: Sequence[Joint] = find_contacts(model, owner) or find_joints(model, owner)
    if joints:
        is_line = owner in model.lines
        _require_key(name, key, OF_LINE if is_line else [parameter.name for parameter in joints[0].parameters])
        size = find_size(joints, key)
        lower, upper = find_factor_bounds(joints, key)
    elif owner in {part.name for part in model.parts}:
        _require_key(name, key, OF_PART)
        size = _compute_part_size(model, owner, key)
        lower, upper = BOUNDS["E"]
    else:
        owners = [*model.lines, *model.joint_groups, *(part.name for part in model.parts)]
        raise EffectError(f'"{name}" belongs to no line, joint or part of the case: there are {", ".join(owners)}')
    if not size:
        raise EffectError(
            f'"{name}" is zero in the case, and a factor cannot change zero: leave it out, or give it a value'
        )
    return ScopedParameter(
        name=name, physics=f"{key} of {owner}.", deviation=deviation, owner=owner, key=key,
        parameters=(make_factor(name, lower, upper, deviation),),
    )  # fmt: skip


def _require_key(name: str, key: str, known: Sequence[str]) -> None:
    if key not in known:
        raise EffectError(f'"{name}" is not a parameter that can be calibrated there: give one of {", ".join(known)}')


def _compute_part_size(model: Model, part: str, key: str) -> float:
    (result,) = (item for item in model.parts if item.name == part)
    if key == "density":
        return float(np.abs(result.mass).max())
    if model.system.structural_damping is not None:
        raise EffectError(
            f'"{part}.E" cannot be calibrated together with structural damping, whose share in each part is unknown: '
            "use E"
        )
    if any(isinstance(sensor, LoadCell) for sensor in model.sensors):
        raise EffectError(f'"{part}.E" cannot be calibrated together with load cells, which read a stiffness: use E')
    return float(np.abs(result.stiffness).max())
