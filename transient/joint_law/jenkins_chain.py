"""Springs with sliders in parallel, and a spring that never slips."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import slide


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    count = slider.size
    end[0], mean[0] = value[2 * count] * after[0], 0.5 * value[2 * count] * (before[0] + after[0])
    for i in range(count):
        stiffness, limit = value[i], value[count + i]
        last, average = slide(
            stiffness * (before[0] - slider[i]), stiffness * (after[0] - before[0]), limit, limit
        )  # fmt: skip
        end[0] += last
        mean[0] += average
        moved[i] = after[0] - last / stiffness


TRANSIENT_LAWS.register(TransientLaw(name="jenkins_chain", force=force))
