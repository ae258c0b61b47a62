r"""Frequencies at which a curve must stop: resonances of the structure with stuck joints.

The steps of a continuation are measured by the motion of the joints. A mode in which the joints hardly move resonates
without changing this motion, and a step may miss it. Its phase turns by 180 degrees across the resonance, at

.. math:: \Omega = \omega_j (1 - \zeta_j \cot \theta) / k

by the angle theta, of a load in harmonic k. A curve stops at each of a few angles of every mode that is visible in some
degree of freedom.
"""

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from reduction.array_type import Array, Real
from reduction.jointed_system import modal_damping

#: Angles at which a curve stops, the resonance in their middle [rad].
ANGLES = np.pi / 12 * np.arange(1, 12)
#: A mode is visible if its peak adds this fraction to the response of a degree of freedom by all other modes.
SHOWN = 0.1
#: A resonance whose half-power bandwidth is 2 / STEPS of the range or more is not sharp: steps do not miss it.
STEPS = 50
#: Least damping ratio: a resonance without damping has no peak.
UNDAMPED = 1e-6


def find_resonance_frequencies(
    balance: HarmonicBalance, lower: float, upper: float
) -> tuple[Float[Real, " s"], Float[Real, " s"]]:
    """Frequencies at which a curve stops, ascending, and the tolerance of each.

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
        # Modes at the same frequency share the stops of one of them.
        if last + near[number] < frequency[number] < upper:
            retained.append(int(number))
            last = frequency[number]
    return frequency[retained], near[retained]


def _shows(shapes: Real, modal_force: Array, impedance: Array, mode: int) -> bool:
    """Whether the peak of a mode is visible in some degree of freedom."""
    amplitude = modal_force / np.where(impedance == 0, np.inf, impedance)
    own = np.abs(shapes[:, mode] * amplitude[mode])
    amplitude[mode] = 0.0
    return bool(np.any(own > SHOWN * np.abs(shapes @ amplitude)))
