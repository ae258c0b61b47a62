r"""The state of a jointed system at one instant: positions, velocities, and where the sliders of its joints stand."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex

from reduction.array_input import check_finite_array, freeze_arrays
from reduction.array_type import Array, Vector
from reduction.jointed_system import JointedSystem
from transient.errors import TransientError
from transient.joint_arrays import make_joint_table


@dataclass(frozen=True, kw_only=True, eq=False)
class TransientState:
    """All that the future of a system depends on, at the phase 0 of its excitation."""

    displacement: Vector
    """q, shape (r,) [m]."""
    velocity: Vector
    """Shape (r,) [m/s]."""
    slider: Vector
    """What joints remember, joints in order, shape (s,) [m]; `Joint.n_slider` numbers of each. A contact has the w of
    each tangent, `JenkinsElement` one, `JenkinsChain` and `IwanJoint` that of each element. `BoucWenJoint` and
    `ValanisJoint` have w = u - z, and `LuGreFriction` as well, with the reach g / sigma_0 of the last instant as a
    second number. A law from outside has its variables of state, in their own units; springs, stops and dampers have
    none."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "displacement", "velocity", "slider")


def at_rest(system: JointedSystem) -> TransientState:
    """No displacement, no velocity, all sliders at 0."""
    return TransientState(
        displacement=np.zeros(system.n_dof),
        velocity=np.zeros(system.n_dof),
        slider=np.zeros(make_joint_table(system).n_slider),
    )


def start_from(
    system: JointedSystem,
    angular_frequency: float,
    coefficients: Complex[Array, "harmonic r"],
    slider: Vector | None = None,
) -> TransientState:
    """State at t = 0 on the periodic motion q(t) = Re sum q_k e^{i k Omega t}.

    Parameters
    ----------
    system, angular_frequency
        The system that moves, and Omega [rad/s].
    coefficients
        q_k of all degrees of freedom, shape (n_harmonic, r) [m].
    slider
        Positions of the sliders at t = 0, shape (s,) [m]; 0 by default, to be moved at once where the friction force
        would exceed its limit.

    Raises
    ------
    TransientError
        Shapes that do not fit the system, or numbers that are not finite.
    """
    values = np.asarray(coefficients, dtype=np.complex128)
    if values.ndim != 2 or values.shape[1] != system.n_dof:
        raise TransientError(
            f"the coefficients have shape {values.shape}: give (n_harmonic, {system.n_dof}), row k for harmonic k"
        )
    rate = 1j * angular_frequency * np.arange(len(values))[:, None] * values
    state = TransientState(
        displacement=values.sum(axis=0).real,
        velocity=rate.sum(axis=0).real,
        slider=np.zeros(make_joint_table(system).n_slider) if slider is None else slider,
    )
    check_state(system, state)
    return state


def check_state(system: JointedSystem, state: TransientState) -> None:
    """Refuse a state that does not fit the system, or has numbers that are not finite (`TransientError`)."""
    n_slider = make_joint_table(system).n_slider
    for name, size in (("displacement", system.n_dof), ("velocity", system.n_dof), ("slider", n_slider)):
        check_finite_array(
            getattr(state, name), f"the {name} of the start", TransientError, (size,), ", as this system has"
        )
