"""Derivatives of a model's matrices, loads, joint parameters and gains with respect to the parameters of effects.

They are closed forms of the parameters, so that central differences are exact to round-off if they are linear or
quadratic. The response is then differentiated by the implicit function theorem (`correlation.prediction`), without a
second solution and without derivatives supplied by the effect.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import LineSensor, Model
from correlation.model_solver import Tangent
from diagnosis.candidate.effect import EffectError
from hbsolve.errors import ModelError
from hbsolve.model_rates import MATRICES, MatrixParameter, ModelParameter
from reduction.jointed_system import JointedSystem

Compose = Callable[[Float[NDArray[np.float64], " p"]], Model]

#: Step of the differences, relative to the size of each parameter: round-off and curvature both stay below 1e-9.
STEP = 1e-4


def differentiate(
    compose: Compose,
    values: Float[NDArray[np.float64], " p"],
    size: Float[NDArray[np.float64], " p"],
    bounds: Sequence[tuple[float, float]],
    first: int = 0,
) -> list[Tangent | None]:
    """Derivatives of a model with respect to each parameter; None if it moves points or directions of joints.

    Parameters
    ----------
    compose
        Function from parameters to the model.
    values, size
        Parameters, and the typical size of each, shape (p,) [unit of each].
    bounds
        Bounds of the parameters; differences are one-sided at a bound, and where the model rejects the next value.
    first
        Index of the first parameter to differentiate; all by default.

    Raises
    ------
    EffectError
        An effect that changes the number of joints.
    ModelError
        The model accepts no neighbouring value of a parameter.
    """
    result: list[Tangent | None] = []
    for number, (lower, upper) in enumerate(bounds):
        if number < first:
            continue
        step = STEP * size[number]
        low, before = _shift_parameter(compose, values, number, max(values[number] - step, lower))
        high, after = _shift_parameter(compose, values, number, min(values[number] + step, upper))
        if low == high:
            raise ModelError(f"parameter number {number} has no neighbouring value that the model takes")
        if _moves(before, after):
            result.append(None)
            continue
        shift = {
            name: _compute_growth(before.frequency_shift, after.frequency_shift, name) for name in ("jointed", "free")
        }
        force_error = {
            name: _compute_growth(before.force_error, after.force_error, name) for name in ("jointed", "free")
        }
        result.append(
            Tangent(
                jointed=_compute_rates(
                    before.system, after.system, high - low, shift["jointed"], force_error["jointed"]
                ),
                free=_compute_rates(
                    before.without_contacts().system,
                    after.without_contacts().system,
                    high - low,
                    shift["free"],
                    force_error["free"],
                ),
                gain={
                    a.name: (b.gain - a.gain) / (high - low)
                    for a, b in zip(before.sensors, after.sensors, strict=True)
                    if a.gain != b.gain
                },
                delay={
                    a.name: (b.delay - a.delay) / (high - low)
                    for a, b in zip(before.sensors, after.sensors, strict=True)
                    if a.delay != b.delay
                },
                frequency_shift={name: change / (high - low) for name, change in shift.items() if change},
            )
        )
    return result


def _shift_parameter(
    compose: Compose, values: Float[NDArray[np.float64], " p"], number: int, value: float
) -> tuple[float, Model]:
    """A value of one parameter and its model; the present value if the model rejects the other."""
    moved = np.array(values, dtype=np.float64)
    moved[number] = value
    try:
        return value, compose(moved)
    except ModelError:
        return float(values[number]), compose(values)


def _moves(before: Model, after: Model) -> bool:
    """Whether points of joints or sensors, or a base excitation, change, which rates of matrices do not cover."""
    joints = zip(before.system.joints, after.system.joints, strict=False)
    if any(not np.array_equal(a.directions, b.directions) for a, b in joints):
        return True
    sensors = zip(before.sensors, after.sensors, strict=True)
    pairs = [(a.row, b.row) for a, b in sensors if not (isinstance(a, LineSensor) or isinstance(b, LineSensor))]
    bases = [np.zeros(0) if item.base_acceleration is None else item.base_acceleration for item in (before, after)]
    return any(not np.array_equal(a, b) for a, b in [*pairs, (bases[0], bases[1])])


def _compute_growth(before: Mapping[str, float], after: Mapping[str, float], configuration: str) -> float:
    """Relative change of the true frequency or force."""
    low, high = (1 + share.get(configuration, 0.0) for share in (before, after))
    return 2 * (high - low) / (high + low)


def _compute_rates(
    before: JointedSystem, after: JointedSystem, step: float, shift: float, force_error: float
) -> ModelParameter:
    """Rates of one configuration; Omega (1 + e) is equivalent to (1 + 2 e) M and (1 + e) C."""
    pair, shifted = (before, after), {"mass": 2 * shift * before.mass, "damping": shift * before.damping}

    def rate(name: str) -> NDArray[np.float64] | None:
        one, other = (np.zeros_like(item.mass) if getattr(item, name) is None else getattr(item, name) for item in pair)
        change = other - one + shifted.get(name, 0.0)
        return np.asarray(change / step) if change.any() else None

    k = max(len(before.dynamic), len(after.dynamic))
    force = np.zeros((k, before.n_dof), dtype=np.complex128)
    force[: len(after.dynamic)] += after.dynamic
    force[: len(before.dynamic)] -= (1 - force_error) * before.dynamic
    return ModelParameter(
        matrices=MatrixParameter(**{name: rate(name) for name in MATRICES}),
        static_load=rate("static"),
        harmonic_force=force / step if force.any() else None,
        joints=_compute_joint_rates(before, after, step),
    )


def _compute_joint_rates(before: JointedSystem, after: JointedSystem, step: float) -> dict[tuple[str, str], float]:
    names = [joint.name for joint in before.joints]
    if names != [joint.name for joint in after.joints]:
        raise EffectError(
            f"the joints change from {', '.join(names) or 'none'} while a parameter is varied: an effect adds its "
            "joint at all values, with zero stiffness where it vanishes"
        )
    rates: dict[tuple[str, str], float] = {}
    for a, b in zip(before.joints, after.joints, strict=True):
        for field, low, high in zip(a.parameter_names, a.parameter_values, b.parameter_values, strict=True):
            if low != high:
                rates[a.name, field] = (high - low) / step
    return rates
