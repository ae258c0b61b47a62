"""Joint laws of the time integration: the data that it requires of each, and the registry of all laws.

Each law gives the force at the end of a step and its *mean over the path*. Along a straight path
u(s) = u_a + s (u_b - u_a) the touch-down, the lift-off and the onset of slip are found exactly, and so is the mean
force of every law but the coupled one; a kink inside a step then costs no more than the curvature of the path does.
The work of a mean force is the work of the law itself, so springs and stops neither create nor lose energy.

A law is one compiled function of this signature::

    force(value, before, after, slider, step, mean, end, moved)

value
    Parameters of the joint, in the order of its law.
before, after
    Positions of its directions at both ends of the step, shape (d,) [m].
slider
    Its sliders before the step, shape (s,) [m].
step
    Length of the step [s].
mean, end, moved
    Filled: mean and end force of each direction, shape (d,) [N], and the sliders after the step, shape (s,) [m].
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from geometry.registry import Registry

ARGUMENTS = "value, before, after, slider, step, mean, end, moved"


def _none(_joint: Any) -> float:
    return 0.0


def _stuck(joint: Any) -> Sequence[float]:
    stiffness: Sequence[float] = joint.stuck_stiffness
    return stiffness


@dataclass(frozen=True, kw_only=True)
class TransientLaw:
    """Force of a joint law over a time step, and what the integration needs to know of it."""

    name: str
    """`Joint.force_law`."""
    force: Callable[..., Any]
    """The compiled function."""
    stuck_stiffness: Callable[[Any], Sequence[float]] = _stuck
    """Of a joint: stiffness of each direction while it sticks and is closed, shape (d,) [N/m]."""
    normal_terms: Callable[[Any], float] = _none
    """Of a joint: |N_0| + k_n |g| in its last direction [N]: normal forces that cancel each other leave round-off of
    the size of their terms, however small their sum."""
    instant: Callable[..., Any] | None = None
    """Of a law with one direction whose force depends on the velocity: the compiled force at an instant,
    ``instant(value, u, velocity, slider)`` [N], for histories: a step knows its mean velocity alone."""


TRANSIENT_LAWS: Registry[TransientLaw] = Registry(
    "joint law of the time integration",
    package="transient.joint_law",
    group=None,
    facts={"force": "the compiled force over a step"},
)
