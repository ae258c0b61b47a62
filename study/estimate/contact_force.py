"""Friction coefficient and preload from measured contact forces: the largest |T / N|, and the static part of N."""

from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import CONTACT_FORCE, Campaign
from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.contact_line import find_contacts
from study.estimate.first_estimate import FirstEstimate

#: Instants of a period, and smallest normal force at which a ratio counts, relative to the largest one [-].
INSTANTS, LEAST_NORMAL = 256, 0.1
#: Smallest relative standard deviation of a ratio of two load cell readings [-].
CELLS = 0.03
OVERSHOOT = (
    "the sum of the measured harmonics may overshoot the force: with harmonics 0 to {harmonics} alone, at least "
    "{certain:.3g} is certain"
)
BIAS = (
    "gross slip may not be reached: a lower bound",
    "forces are those of the whole line: single contacts of it may carry more",
)


def estimate_from_forces(model: Model, campaign: Campaign) -> Iterator[FirstEstimate]:
    """Estimate friction coefficient (from both forces) and preload (from the normal force) of each contact line."""
    for line in sorted({sensor.line for sensor in campaign.sensors if sensor.line is not None}):
        if line not in model.lines:
            continue
        contacts = find_contacts(model, line)
        tangential, normal = (_collect_harmonics(campaign, line, component) for component in ("tangential", "normal"))
        states = sorted(set(tangential) & set(normal))
        ratios = [
            (_compute_largest_ratio(tangential[state], normal[state]), state) for state in states if 0 in normal[state]
        ]
        if ratios:
            top, state = max(ratios)
            # The scatter is that of the repeats at the same test, level and frequency.
            alike = [ratio for ratio, other in ratios if other[:3] == state[:3]]
            deviation = max(float(np.std(alike)) if len(alike) > 1 else 0.0, CELLS * top)
            known = count_harmonics(tangential[state], normal[state])
            certain = compute_largest_certain_ratio(tangential[state], normal[state], known)
            yield FirstEstimate(
                parameter="mu",
                value=top,
                interval=(certain * (1 - TWO_SIDED_95 * deviation / top), np.inf),
                unit="-",
                model_value=float(np.mean([contact.friction_coefficient for contact in contacts])),
                source=f"largest |T / N| of {line}, at {state[1]:.4g} {campaign.drive.unit} and {state[2]:.5g} Hz",
                bias=(*BIAS, OVERSHOOT.format(certain=certain, harmonics=known)),
            )
        static = [rows[0].real for rows in normal.values() if 0 in rows]
        if static:
            mean, spread = float(np.mean(static)), float(np.std(static))
            yield FirstEstimate(
                parameter="preload",
                value=mean,
                interval=(mean - TWO_SIDED_95 * spread, mean + TWO_SIDED_95 * spread),
                unit="N",
                model_value=float(sum(max(contact.preload, 0.0) for contact in contacts)),
                source=f"static part of N of {line}",
                bias=("vibration changes static forces: tests at the lowest level are nearest to the preload",),
            )


State = tuple[int, float, float, int, int]


def _collect_harmonics(campaign: Campaign, line: str, component: str) -> dict[State, dict[int, complex]]:
    """Complex coefficients of a contact force by test, level, frequency, sweep and repeat, then by harmonic [N]."""
    wanted = [
        number
        for number, sensor in enumerate(campaign.sensors)
        if sensor.quantity == CONTACT_FORCE and sensor.line == line and sensor.component == component
        and sensor.calibrated and sensor.has_phase
    ]  # fmt: skip
    table = campaign.measurement
    rows = np.flatnonzero(np.isin(table.sensor, wanted) & ~campaign.held_out.rows(table))
    states: dict[State, dict[int, complex]] = {}
    for row in rows:
        state = (
            int(table.test[row]), float(table.level[row]), float(table.frequency[row]), int(table.sweep[row]),
            int(table.repeat[row]),
        )  # fmt: skip
        states.setdefault(state, {})[int(table.harmonic[row])] = complex(table.value[row])
    return states


def count_harmonics(*forces: Mapping[int, complex]) -> int:
    """Highest harmonic up to which all harmonics of all forces are measured [-]."""
    count = 0
    while all(count + 1 in force for force in forces):
        count += 1
    return count


def compute_largest_certain_ratio(tangential: Mapping[int, complex], normal: Mapping[int, complex], n: int) -> float:
    r"""Largest abs(T / N) of both forces, smoothed so that only the harmonics 0 to n contribute.

    Both forces are smoothed with Jackson's kernel, which is nowhere negative: if abs(T(t)) <= mu N(t) at every instant,
    the smoothed forces obey this as well, whatever the harmonics beyond n are. Truncated sums of harmonics do not: they
    overshoot.

    Parameters
    ----------
    tangential, normal
        Coefficients by harmonic [N].
    n
        Highest harmonic [-].

    References
    ----------
    Weisse et al., The kernel polynomial method, Rev. Mod. Phys. 78 (2006), eq. 71.
    """
    k, order = np.arange(n + 1), n + 2
    angle = np.pi / order
    kernel = ((order - k) * np.cos(k * angle) + np.sin(k * angle) / np.tan(angle)) / order
    t, p = ({j: complex(kernel[j]) * force.get(j, 0.0) for j in range(n + 1)} for force in (tangential, normal))
    return _compute_largest_ratio(t, p)


def _compute_largest_ratio(tangential: Mapping[int, complex], normal: Mapping[int, complex]) -> float:
    """Largest |T / N| over a period, at instants with a normal force above `LEAST_NORMAL` of its largest."""
    t, n = _signal(tangential), _signal(normal)
    pressed = n > LEAST_NORMAL * np.abs(n).max()
    return float(np.abs(t[pressed] / n[pressed]).max()) if pressed.any() else 0.0


def _signal(coefficients: Mapping[int, complex]) -> NDArray[np.float64]:
    phase = 2 * np.pi * np.arange(INSTANTS)[:, None] / INSTANTS * np.array(list(coefficients))
    values: Complex[NDArray[np.complex128], " h"] = np.array(list(coefficients.values()))
    return np.asarray((np.exp(1j * phase) @ values).real)
