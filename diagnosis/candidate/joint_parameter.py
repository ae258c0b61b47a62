"""Scaled parameters of joints other than contact lines, such as the limit force of a lap joint."""

from collections.abc import Mapping, Sequence

import numpy as np

from correlation.model import Model
from reduction.errors import JointError
from reduction.joint_law.registry import Joint

#: Bounds of a factor: joints are known to an order of magnitude.
BOUNDS = (0.1, 10.0)
#: Relative accuracy of the largest or smallest factor that a law accepts.
FACTOR_ACCURACY = 1e-6


def find_joints(model: Model, name: str) -> list[Joint]:
    """Joints of one of `Model.joint_groups`; empty for any other name."""
    members = model.joint_groups.get(name, ())
    return [joint for joint in model.system.joints if joint.name in members]


def scale_joints(model: Model, name: str, key: str, factor: float) -> Model:
    """Model with one parameter of all joints of a group times a factor."""
    return model.with_joints({joint.name: scale_parameter(joint, key, factor) for joint in find_joints(model, name)})


def scale_parameter(joint: Joint, key: str, factor: float) -> Mapping[str, float]:
    """Values of a parameter times a factor, by their names; a list parameter has several."""
    (parameter,) = (item for item in joint.parameters if item.name == key)
    return dict(zip(parameter.names(joint), (factor * value for value in parameter.values(joint)), strict=True))


def find_size(joints: Sequence[Joint], key: str) -> float:
    """Largest absolute value of a parameter [its unit]."""
    return max(abs(value) for joint in joints for value in scale_parameter(joint, key, 1.0).values())


def find_factor_bounds(joints: Sequence[Joint], key: str) -> tuple[float, float]:
    """The factors closest to `BOUNDS` that the laws of all joints accept [-]."""
    return _find_furthest(joints, key, BOUNDS[0]), _find_furthest(joints, key, BOUNDS[1])


def _find_furthest(joints: Sequence[Joint], key: str, bound: float) -> float:
    def takes(factor: float) -> bool:
        try:
            for joint in joints:
                joint.with_values(scale_parameter(joint, key, factor))
        except JointError:
            return False
        return True

    taken, refused = (bound, bound) if takes(bound) else (1.0, bound)
    while abs(refused / taken - 1) > FACTOR_ACCURACY:
        middle = np.sqrt(taken * refused)
        taken, refused = (middle, refused) if takes(middle) else (taken, middle)
    return float(taken)
