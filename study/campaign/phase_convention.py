"""Sign of time and sign of a sensor, from the phases around the largest response."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

#: Phase of the response to a force at a resonance, for a sensor at the force and e^{+i Omega t} [rad].
AT_RESONANCE = {"displacement": -np.pi / 2, "velocity": 0.0, "acceleration": np.pi / 2}
#: Largest distance from such a phase at which it determines the quantity [rad].
MAX_PHASE_DISTANCE = np.radians(30)
#: Smallest change of a phase over the frequencies that determines the sign of time [rad].
LEAST_CHANGE = 0.8
#: Smallest ratio of a clear peak to the median response [-].
PEAK = 2.0


@dataclass(frozen=True, kw_only=True)
class PhaseEvidence:
    """Evidence from the phases of one response.

    Parameters
    ----------
    change
        Change of phase with increasing frequency across the peak [rad]; negative for e^{+i Omega t}.
    at_peak
        Phase at the largest response [rad].
    stands_out
        Whether the largest response is a clear peak.
    is_passed
        Whether the largest response is not at an end of the band, so that its phase is that of a resonance if the phase
        changes.
    """

    change: float
    at_peak: float
    stands_out: bool
    is_passed: bool = False

    @property
    def time_sign(self) -> int:
        """+1 for e^{+i Omega t}, -1 for e^{-i Omega t}, 0 if the change is too small."""
        return 0 if abs(self.change) < LEAST_CHANGE else (1 if self.change < 0 else -1)


def judge_phase(
    frequency: Float[NDArray[np.float64], " n"], response: Complex[NDArray[np.complex128], " n"]
) -> PhaseEvidence | None:
    """Judge the phase across the largest response.

    Parameters
    ----------
    frequency
        Frequencies in any order, shape (n,).
    response
        Complex response per force, shape (n,).

    Returns
    -------
    Evidence; None for fewer than five finite, nonzero values.
    """
    there = np.isfinite(response) & np.isfinite(frequency) & (np.abs(response) > 0)
    if there.sum() < 5:
        return None
    order = np.argsort(frequency[there], kind="stable")
    values = response[there][order]
    size = np.abs(values)
    peak = int(np.argmax(size))
    # A step counts if both of its ends have a large response: far from resonances noise determines the phase.
    turns = np.angle(values[1:] / values[:-1])
    near = np.minimum(size[1:], size[:-1]) > 0.1 * size[peak]
    stretch = near & (np.abs(np.arange(len(near)) - peak) <= max(5, len(near) // 3))
    is_passed = 0 < peak < len(size) - 1
    return PhaseEvidence(
        change=float(turns[stretch].sum()),
        at_peak=float(np.angle(values[peak])),
        stands_out=bool(size[peak] > PEAK * np.median(size) and is_passed),
        is_passed=is_passed,
    )


def has_opposite_sign(evidence: PhaseEvidence, quantity: str, time_sign: int) -> bool:
    """Whether a sensor at the force has the opposite sign, such as an acceleration with the phase of a displacement.

    Parameters
    ----------
    evidence
        Phases.
    quantity
        "displacement", "velocity" or "acceleration".
    time_sign
        Sign of i Omega t.
    """
    if not evidence.stands_out or quantity not in AT_RESONANCE:
        return False
    away = np.angle(np.exp(1j * (time_sign * evidence.at_peak - AT_RESONANCE[quantity])))
    return bool(abs(away) > np.radians(120))


def name_motion(evidence: PhaseEvidence, time_sign: int) -> str:
    """Quantity with this phase at a resonance, for a sensor at the force; empty if no phase is near.

    Parameters
    ----------
    evidence
        Phases.
    time_sign
        Sign of i Omega t.
    """
    away = {
        quantity: abs(float(np.angle(np.exp(1j * (time_sign * evidence.at_peak - phase)))))
        for quantity, phase in AT_RESONANCE.items()
    }
    nearest = min(away, key=lambda quantity: away[quantity])
    return nearest if away[nearest] < MAX_PHASE_DISTANCE else ""
