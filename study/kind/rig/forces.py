"""Forces of a rig over one period: of each contact line, and of the load cells behind the de-couplers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from geometry.rig import SIDES, mating_pairs
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import ContactMotion, contact_motion
from hbsolve.fourier import harmonics, samples_from_coefficients
from hbsolve.state import SteadyState
from reduction.load_cell import LineReaction, compute_blade_contact, compute_decoupler_contact, resolve_along_line
from study.kind.rig.structure import ARMS, PreloadedRig, compute_arm_direction

Samples = Float[NDArray[np.float64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class LineMotion:
    """Forces and states of one contact line over a period of n instants.

    Parameters
    ----------
    force
        Sums over the stations of the forces on the body that the damper touches: T away from the damper along the line,
        N into the body, each of shape (n,) [N].
    status
        State of each station, shape (station, n): 0 stuck, 1 slipping in any tangent, 2 separated.
    """

    force: LineReaction
    status: Int[NDArray[np.int64], "station n"]

    @property
    def ratio(self) -> float:
        """Largest |T| / N of the period [-]; infinite if the normal force vanishes at any instant."""
        T, N = self.force
        return float(np.max(np.abs(T) / np.where(N > 0, N, np.nan))) if (N > 0).all() else float("inf")


@dataclass(frozen=True, kw_only=True, eq=False)
class RigForces:
    """Forces of a rig in a steady state.

    Parameters
    ----------
    time
        Time as a fraction of the period, shape (n,) [-].
    lines
        Forces and states of each contact line, by pair.
    cells
        Push of each arm on its load cell, by de-coupler: upper, then lower, shape (2, n) [N].
    measured
        Forces of each line from the pushes of the arms by eqs 1 and 2.
    balanced
        Forces of each line from the whole forces of the arms, with the components across the arms.
    """

    time: Samples
    lines: Mapping[str, LineMotion]
    cells: Mapping[str, Float[NDArray[np.float64], "2 n"]]
    measured: Mapping[str, LineReaction]
    balanced: Mapping[str, LineReaction]

    @property
    def inertia_error(self) -> dict[str, float]:
        """Error of eqs 1 and 2 from the neglected inertia of de-coupler and damper, by pair, see `_compare` [-]."""
        return {name: _compare(self.balanced[name], line.force) for name, line in self.lines.items()}

    @property
    def bending_error(self) -> dict[str, float]:
        """Error from the neglected forces across the arms, which bend because they are not hinged, by pair [-]."""
        return {name: _compare(self.measured[name], self.balanced[name]) for name in self.lines}


def _compare(result: LineReaction, true: LineReaction) -> float:
    """Largest difference of T or N over the period, relative to the largest absolute value of both [-]."""
    size = max(float(np.abs(item).max()) for item in true)
    return max(float(np.abs(a - b).max()) for a, b in zip(result, true, strict=True)) / size


def compute_rig_forces(preloaded: PreloadedRig, balance: HarmonicBalance, state: SteadyState) -> RigForces:
    """Compute the forces of all contact lines and load cells in a steady state.

    Parameters
    ----------
    preloaded
        Rig under its dead weights.
    balance, state
        Steady state, and harmonic balance at its level.
    """
    rig, weights = preloaded.model.rig, preloaded.weights
    motions = {motion.name: motion for motion in contact_motion(balance, state)}
    lines, cells = {}, {}
    measured: dict[str, LineReaction] = {}
    balanced: dict[str, LineReaction] = {}
    for name, pair in mating_pairs(rig).items():
        sign = float(np.sign(pair.damper_line.tangents[0, 0] @ _find_outward(name)))
        lines[name] = _make_line_motion([motions[item] for item in preloaded.joined.lines[name]], sign)
    theta, alpha = rig.damper.cone_half_angle, rig.decoupler.arm_angle
    for side, (sign, _) in SIDES.items():
        body = f"decoupler_{side}"
        push = {cell: -_compute_reaction(preloaded, body, cell, balance, state) for cell in ARMS}
        cells[body] = np.array([compute_arm_direction(side, cell, alpha) @ push[cell] for cell in ARMS])
        whole = np.sum(list(push.values()), axis=0)
        weight = weights[side].force * cos(weights[side].inclination)
        for result, own in (
            (measured, compute_decoupler_contact(cells[body][0], cells[body][1], theta, alpha)),
            (balanced, resolve_along_line(sign * whole[1], whole[2], theta)),
        ):
            result[f"{side}_decoupler"] = own
            result[f"{side}_blade"] = compute_blade_contact(own, weight, theta)
    time = np.arange(balance.n_sample) / balance.n_sample
    return RigForces(time=time, lines=lines, cells=cells, measured=measured, balanced=balanced)


def _find_outward(pair: str) -> Float[NDArray[np.float64], "3"]:
    """Unit vector along y from the damper to the other body of a pair."""
    side, _, other = pair.partition("_")
    outward = SIDES[side][0]
    return np.array([0.0, outward if other == "decoupler" else -outward, 0.0])


def _make_line_motion(motions: Sequence[ContactMotion], sign: float) -> LineMotion:
    T = sign * np.sum([motion.force[0] for motion in motions], axis=0)
    N = np.sum([motion.force[-1] for motion in motions], axis=0)
    return LineMotion(
        force=LineReaction(tangential=T, normal=N), status=np.array([motion.status.max(axis=0) for motion in motions])
    )


def _compute_reaction(
    preloaded: PreloadedRig, body: str, cell: str, balance: HarmonicBalance, state: SteadyState
) -> Float[NDArray[np.float64], "3 n"]:
    """Force of a fixed face on a body over the period, including the force at rest, shape (3, n) [N]."""
    rows = preloaded.reduction.reactions[body][cell]
    omega = harmonics(state.angular_frequency, len(state.coefficients))
    q = state.coefficients
    moving = q @ rows.stiffness.T - omega[:, None] ** 2 * (q @ rows.mass.T)
    at_rest = rows.stiffness @ preloaded.static_state.displacement
    return np.asarray(samples_from_coefficients(moving, balance.n_sample).T + at_rest[:, None])
