"""Sign of time and sign of a sensor, judged from the phases around the largest response."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

#: Phase of the response to a force at a resonance, where the sensor sits at the force [rad], for e^{+i Omega t}.
AT_RESONANCE = {"displacement": -np.pi / 2, "velocity": 0.0, "acceleration": np.pi / 2}
#: Largest distance from such a phase at which the quantity is told [rad].
MAX_PHASE_DISTANCE = np.radians(30)
#: A phase that changes by less over the frequencies tells nothing [rad].
LEAST_CHANGE = 0.8
#: A peak must stand out by this factor over the median response to tell a sign [-].
PEAK = 2.0


@dataclass(frozen=True, kw_only=True)
class PhaseEvidence:
    """What phases say.

    Parameters
    ----------
    change
        Change of phase over rising frequency across the peak [rad]; it falls for e^{+i Omega t}.
    at_peak
        Phase at the largest response [rad].
    stands_out
        Whether the largest response is a clear peak.
    is_passed
        Whether the largest response has others on either side, so that the phase there is that of a resonance if it
        changes.
    """

    change: float
    at_peak: float
    stands_out: bool
    is_passed: bool = False

    @property
    def time_sign(self) -> int:
        """+1 for e^{+i Omega t}, -1 for e^{-i Omega t}, 0 if it cannot be told."""
        return 0 if abs(self.change) < LEAST_CHANGE else (1 if self.change < 0 else -1)


def judge_phase(
    frequency: Float[NDArray[np.float64], " n"], response: Complex[NDArray[np.complex128], " n"]
) -> PhaseEvidence | None:
    """Phase across the largest response.

    Parameters
    ----------
    frequency
        Frequencies in any order, shape (n,).
    response
        Complex response per force, shape (n,).

    Returns
    -------
    The evidence; None for fewer than five finite values.
    """
    there = np.isfinite(response) & np.isfinite(frequency) & (np.abs(response) > 0)
    if there.sum() < 5:
        return None
    order = np.argsort(frequency[there], kind="stable")
    values = response[there][order]
    size = np.abs(values)
    peak = int(np.argmax(size))
    # Steps count as far as both of their ends respond: noise far from resonances has any phase.
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
    """Whether a sensor at the force reads with the opposite sign, such as an acceleration with a displacement's phase.

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
    """The quantity that has this phase at a resonance, where the sensor is at the force; empty if none is near.

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
