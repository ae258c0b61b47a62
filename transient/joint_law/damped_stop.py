"""A spring and a dashpot beyond a clearance, on one side or on both."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def pressed(value: Vector, indentation: float, velocity: float) -> float:
    """Force of one side at an instant."""
    grown = max(indentation, 0.0)
    return float(max(value[0] * grown + value[1] * min(grown / value[2], 1.0) * velocity, 0.0))


@compiled
def instant(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    return pressed(value, u - value[3], velocity)


@compiled
def instant_of_both(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    return pressed(value, u - value[3], velocity) - pressed(value, -u - value[3], -velocity)


@compiled
def side(value: Vector, before: float, after: float, step: float) -> tuple[float, float]:
    """Force at the end of a step and its mean, for an indentation from `before` to `after`."""
    stiffness, damping, depth = value[0], value[1], value[2]
    velocity = (after - before) / step
    # At one velocity the force is linear in the indentation between these: touch, full dashpot, and release.
    marks = (0.0, depth, -damping * velocity / stiffness)
    end, mean, passed, held = 0.0, 0.0, 0.0, 0.0
    for number in range(len(marks) + 2):
        if number == 0:
            share = 0.0
        else:
            # The next mark on the path.
            share = 1.0
            for mark in marks:
                at = (mark - before) / (after - before) if after != before else 1.0
                if passed < at < share:
                    share = at
        end = pressed(value, before + share * (after - before), velocity)
        mean += 0.5 * (held + end) * (share - passed)
        passed, held = share, end
    return end, mean


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    end[0], mean[0] = side(value, before[0] - value[3], after[0] - value[3], step)


@compiled
def force_of_both(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    end[0], mean[0] = side(value, before[0] - value[3], after[0] - value[3], step)
    last, average = side(value, -before[0] - value[3], -after[0] - value[3], step)
    end[0] -= last
    mean[0] -= average


TRANSIENT_LAWS.register(
    TransientLaw(
        name="damped_stop",
        force=force,
        instant=instant,
        stuck_stiffness=lambda joint: [joint.stiffness],
        normal_terms=lambda joint: abs(joint.stiffness * joint.gap),
    )
)
TRANSIENT_LAWS.register(
    TransientLaw(
        name="damped_play",
        force=force_of_both,
        instant=instant_of_both,
        stuck_stiffness=lambda joint: [joint.stiffness],
        normal_terms=lambda joint: joint.stiffness * joint.gap,
    )
)
