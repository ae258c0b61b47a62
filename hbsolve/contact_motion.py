"""Behaviour of a joint over a period: displacement, forces, slider, states, hysteresis loop."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.joint_law.registry import FORCE
from hbsolve.solution import forces_at
from hbsolve.state import SteadyState, check_state
from reduction.array_type import Matrix, Real, Vector, Whole


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactMotion:
    """One joint over one period, at n instants; d directions (tangents, then the normal), s sliders."""

    name: str
    """Name of the joint."""
    time: Float[Real, " n"]
    """Instants, shape (n,) [s]."""
    displacement: Float[Real, "d n"]
    """Displacement of each direction, shape (d, n) [m]."""
    force: Float[Real, "d n"]
    """Force on the structure against each displacement: T of the tangents, N of the normal, shape (d, n) [N]."""
    slider: Float[Real, "s n"]
    """Slider positions, shape (s, n) [m]."""
    status: Int[Whole, "t n"]
    """State of each tangent, or of a joint with one direction: 0 stick, 1 slip, 2 separated, shape (t, n). Sliders in
    parallel (`JenkinsChain`, `IwanJoint`) slip where all of them slip; a smooth hysteresis where its slider follows at
    least half of the motion; a user's law where its state changes."""
    share: Float[Real, " 3"]
    """Fractions of the period in stick, slip and separation, tangents together, shape (3,) [-]."""

    @property
    def dissipated(self) -> Float[Real, " d"]:
        """Work that each direction takes from the structure in a period: the area of its loop, shape (d,) [J]."""
        n = self.displacement.shape[1]
        # The displacement has only harmonics 0 to H, so that its derivative through the Fourier series is exact.
        wave = np.fft.rfft(self.displacement, axis=1)
        slope = np.fft.irfft(1j * np.arange(wave.shape[1]) * wave, n, axis=1)
        return np.asarray(2 * np.pi / n * (self.force * slope).sum(axis=1))


def contact_motion(balance: HarmonicBalance, state: SteadyState) -> tuple[ContactMotion, ...]:
    """Displacements, forces and states of every joint over the steady period of a state.

    Raises
    ------
    BalanceError
        A state of another balance.
    """
    forces, u = _evaluate_forces(balance, state)
    time = 2 * np.pi / state.angular_frequency * np.arange(balance.n_sample) / balance.n_sample
    force = forces.force + balance.table.reference[:, None] * u
    directions, sliders = balance.table.direction, balance.table.slider
    motions = []
    for number, joint in enumerate(balance.system.joints):
        d, s = slice(directions[number], directions[number + 1]), slice(sliders[number], sliders[number + 1])
        status = find_contact_status(balance, forces, number)
        motions.append(
            ContactMotion(
                name=joint.name,
                time=time,
                displacement=u[d],
                force=force[d],
                slider=forces.slider[s],
                status=status,
                share=_share(status),
            )
        )
    return tuple(motions)


def contact_share(balance: HarmonicBalance, state: SteadyState) -> Float[Real, "joint 3"]:
    """Fractions of the period in stick, slip and separation of each joint, shape (n_joint, 3) [-]."""
    forces, _ = _evaluate_forces(balance, state)
    shares = [_share(find_contact_status(balance, forces, number)) for number in range(len(balance.system.joints))]
    return np.array(shares).reshape(-1, 3)


def find_contact_status(balance: HarmonicBalance, forces: JointForces, number: int) -> Int[Whole, "t n"]:
    """State of the tangents of one joint at each instant, see `ContactMotion.status`."""
    joint = balance.system.joints[number]
    n_tangent = len(joint.directions) - (joint.normal_direction is not None)
    return forces.status[2 * number : 2 * number + max(n_tangent, 1)]


def _evaluate_forces(balance: HarmonicBalance, state: SteadyState) -> tuple[JointForces, Matrix]:
    check_state(balance, state)
    x = state.motion
    forces = forces_at(balance, state.angular_frequency, x, state.sliders, want=FORCE)
    return forces, x @ balance.sampling.evaluate


def _share(status: Int[Whole, "t n"]) -> Vector:
    return np.bincount(status.ravel(), minlength=3) / status.size
