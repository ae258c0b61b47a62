r"""Frequencies that a curve must not step over: where the structure resonates with its joints stuck.

The steps of a continuation are measured by the motion of the joints. A mode that they hardly feel resonates without
changing this motion, and a step may pass it by. Its phase turns by 180 degrees across the resonance, at

.. math:: \Omega = \omega_j (1 - \zeta_j \cot \theta) / k

by the angle theta, of a load in harmonic k. A curve stops at each of a few angles of every mode that some degree of
freedom would show.
"""

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from reduction.array_type import Array, Real
from reduction.jointed_system import modal_damping

#: Angles at which a curve stops, the resonance in their middle [rad].
ANGLES = np.pi / 12 * np.arange(1, 12)
#: A mode shows if its peak adds this share to the response of a degree of freedom by all others.
SHOWN = 0.1
#: A resonance whose half-power bandwidth is twice this part of the range is no sharp one: steps land on it anyway.
STEPS = 50
#: Least damping ratio: a resonance without damping has no peak.
UNDAMPED = 1e-6


def find_resonance_frequencies(
    balance: HarmonicBalance, lower: float, upper: float
) -> tuple[Float[Real, " s"], Float[Real, " s"]]:
    """Frequencies at which a curve stops, ascending, and how far each may be missed.

    Parameters
    ----------
    balance
        System with its loads.
    lower, upper
        Range of Omega [rad/s].

    Returns
    -------
    Omega of each, and a quarter of the distance to its neighbours of the same mode, shapes (s,) [rad/s].
    """
    modes = balance.structure.stuck.modes
    shapes, natural = modes.mode_shapes, np.sqrt(modes.lambda_.clip(min=0.0))
    width = modal_damping(balance.system, shapes, natural)  # 2 zeta omega
    frequencies, margin = [np.zeros(0)], [np.zeros(0)]
    for harmonic in range(1, balance.n_harmonic):
        modal_force = shapes.T @ balance.structure.dynamic[harmonic]
        inside = (natural > harmonic * lower) & (natural < harmonic * upper) & (np.abs(modal_force) > 0)
        for mode in np.flatnonzero(inside):
            omega, half = natural[mode], width[mode] / 2
            is_sharp = UNDAMPED * omega <= half < harmonic * (upper - lower) / STEPS
            impedance = natural**2 - omega**2 + 1j * omega * width
            if not is_sharp or not _shows(shapes, modal_force, impedance, int(mode)):
                continue
            frequencies.append((omega - half / np.tan(ANGLES)) / harmonic)
            margin.append(np.full(len(ANGLES), 0.25 * half * ANGLES[0] / harmonic))
    frequency, near = np.concatenate(frequencies), np.concatenate(margin)
    order = np.argsort(frequency)
    retained, last = list[int](), lower
    for number in order:
        # Of modes at one frequency one has the stops.
        if last + near[number] < frequency[number] < upper:
            retained.append(int(number))
            last = frequency[number]
    return frequency[retained], near[retained]


def _shows(shapes: Real, modal_force: Array, impedance: Array, mode: int) -> bool:
    """Whether the peak of a mode shows in some degree of freedom."""
    amplitude = modal_force / np.where(impedance == 0, np.inf, impedance)
    own = np.abs(shapes[:, mode] * amplitude[mode])
    amplitude[mode] = 0.0
    return bool(np.any(own > SHOWN * np.abs(shapes @ amplitude)))
