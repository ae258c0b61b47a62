"""Damping and contact stiffness from resonances: the lowest level of stepped sines, the end of ring-downs, modes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, match_level
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import MeasuredMode
from correlation.data_type.ring_down import FreeDecay
from correlation.metric.mode_pairing import pair_modes
from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from diagnosis.fit.calibration_parameter import BOUNDS, CONTACT, DEVIATION
from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import modal_damping
from reduction.stuck import stick_at_rest
from study.estimate.first_estimate import FirstEstimate
from study.estimate.level_modes import LevelMode, read_level_modes

SLIPS = "the lowest level may already slip a little: the damping includes friction then, and is an upper bound"
STEADY = "the damping does not grow with the amplitude: it includes no friction"
LINEAR = "the model has no joint that could slip: all damping counts as that of the structure"
FREE = "damping of the structure without contacts: it includes bearings and air, but no friction"
SOFTENED = (
    "the lowest level may already slip a little: the frequency is corrected by half of the largest shift that "
    "micro-slip with the measured friction damping may cause, and the interval spans zero to the full shift"
)
OTHER = "a frequency error of the model beyond that of the free structure is attributed to the stiffness"
ALONE = "the modulus of the model is assumed to be correct within 1 %: measure the structure without its contacts, too"
#: Smallest relative standard deviations of a measured frequency and of a measured damping ratio [-].
LEAST_FREQUENCY, LEAST_DAMPING = 3e-4, 0.03
#: Largest ratio, in either direction, of the frequencies of a measured mode and of its mode in the model [-].
MAX_FREQUENCY_FACTOR = 1.4
#: Largest relative fall of a frequency by friction, per damping ratio that friction adds [-]: micro-slip on a curve
#: F = k u - c u^2, whose Masing loops lose c A of their stiffness at amplitude A, and dissipate 4 / 3 c A^3 per cycle.
MOST_SOFTENING = 3 * np.pi / 4
#: Factors on the tangential stiffness at which the stuck frequency is computed [-].
GRID = np.geomspace(*BOUNDS["kt"], 40)


@dataclass(frozen=True, kw_only=True)
class MeasuredResonance:
    """Measured resonance at small amplitude.

    Parameters
    ----------
    free
        Whether the structure had no contacts.
    frequency, frequency_deviation
        Frequency and its standard deviation [Hz].
    damping, damping_deviation
        Damping ratio and its standard deviation [-]; NaN where unknown.
    source
        Data from which it was read, in words.
    is_steady
        Whether the damping is the same at larger amplitudes, so that it includes no friction.
    is_largest
        Whether no other resonance of the same stepped sines is larger.
    """

    free: bool
    frequency: float
    frequency_deviation: float
    damping: float
    damping_deviation: float
    source: str
    is_steady: bool = False
    is_largest: bool = True


def find_resonances(campaign: Campaign) -> Iterator[MeasuredResonance]:
    """List resonances: at the lowest level of stepped sines, in the last half of ring-downs, and measured modes."""
    yield from _read_stepped_sines(campaign)
    for datum in campaign.data:
        if isinstance(datum, FreeDecay) and not datum.held_out:
            for mode in datum.modes:
                # Of the second half, which has the smallest amplitudes, the point with the most certain damping.
                last = len(mode.frequency) // 2 + int(np.argmin(mode.damping_deviation[len(mode.frequency) // 2 :]))
                yield MeasuredResonance(
                    free=datum.configuration == "free",
                    frequency=float(mode.frequency[last]),
                    frequency_deviation=float(mode.frequency_deviation[last]),
                    damping=float(mode.damping_ratio[last]),
                    damping_deviation=float(mode.damping_deviation[last]),
                    source=f'ring-down "{datum.name}" at {mode.amplitude[last]:.3g} {datum.unit}',
                    is_steady=last > 0
                    and _are_equal(
                        float(mode.damping_ratio[last]),
                        float(mode.damping_deviation[last]),
                        float(mode.damping_ratio[0]),
                        float(mode.damping_deviation[0]),
                    ),
                )
        elif isinstance(datum, MeasuredMode | MeasuredResponse) and not datum.held_out:
            for measured in (datum,) if isinstance(datum, MeasuredMode) else datum.modes:
                yield MeasuredResonance(
                    free=measured.configuration == "free",
                    frequency=measured.frequency,
                    frequency_deviation=measured.frequency_deviation,
                    damping=measured.damping,
                    damping_deviation=measured.damping_deviation,
                    source=f'mode "{measured.name}"',
                )


def _read_stepped_sines(campaign: Campaign) -> Iterator[MeasuredResonance]:
    table = campaign.measurement
    trained = ~campaign.held_out.rows(table)
    for number, test in enumerate(campaign.tests):
        own = trained & (table.test == number) & (table.harmonic == 1)
        if not own.any():
            continue
        level = float(table.level[own].min())
        at_lowest = match_level(table.level, level)
        modes, higher, above = read_level_modes(campaign, own & at_lowest), own & ~at_lowest, list[LevelMode]()
        if higher.any():
            above = read_level_modes(campaign, own & match_level(table.level, float(table.level[higher].min())))
        partners = pair_modes([{0: mode.peak} for mode in modes], [{0: mode.peak} for mode in above])
        for number, mode in enumerate(modes):
            partner = above[partners[number]] if number in partners else None
            yield MeasuredResonance(
                free=test.configuration == "free",
                frequency=mode.frequency,
                frequency_deviation=mode.frequency_deviation,
                damping=mode.damping,
                damping_deviation=mode.damping_deviation,
                source=f'test "{test.name}" at {level:.4g} {campaign.drive.unit}'
                + (f" near {mode.frequency:.4g} Hz" if len(modes) > 1 else ""),
                is_steady=partner is not None
                and _are_equal(mode.damping, mode.damping_deviation, partner.damping, partner.damping_deviation),
                is_largest=mode.size == max(item.size for item in modes),
            )


def _are_equal(one: float, deviation: float, other: float, other_deviation: float) -> bool:
    """Whether the difference of two damping ratios is within their scatter plus `LEAST_DAMPING`."""
    return abs(other - one) <= TWO_SIDED_95 * float(np.hypot(deviation, other_deviation)) + LEAST_DAMPING * one


def estimate_damping(model: Model, resonance: MeasuredResonance) -> Iterator[FirstEstimate]:
    """Estimate the damping ratio of the structure from one resonance, if the model has its mode."""
    ratio = damping_ratio(model, resonance)
    if not np.isfinite(resonance.damping) or ratio is None or not ratio > 0:
        return
    deviation = float(np.hypot(resonance.damping_deviation, LEAST_DAMPING * resonance.damping))
    joints = (model.without_contacts() if resonance.free else model).system.joints
    slips = bool(joints) and not resonance.is_steady
    low = 0.0 if slips else max(resonance.damping - TWO_SIDED_95 * deviation, 0.0)
    yield FirstEstimate(
        parameter="zeta",
        value=resonance.damping,
        interval=(low, resonance.damping + TWO_SIDED_95 * deviation),
        unit="-",
        model_value=ratio,
        source=resonance.source,
        bias=(SLIPS if slips else FREE if resonance.free else STEADY if joints else LINEAR,),
        is_upper_bound=slips,
    )


def damping_ratio(model: Model, resonance: MeasuredResonance) -> float | None:
    """Damping ratio of the model's mode at a resonance, contacts stuck [-]; None if the model has no mode there."""
    system = (model.without_contacts() if resonance.free else model).system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    own = modes.frequency
    nearest = _find_nearest(own, resonance.frequency)
    if not 1 / MAX_FREQUENCY_FACTOR < own[nearest] / resonance.frequency < MAX_FREQUENCY_FACTOR:
        return None
    shape = modes.mode_shapes[:, nearest]
    modal_mass = float(shape @ system.mass @ shape)
    omega = np.sqrt(modes.lambda_[[nearest]])
    return float(modal_damping(system, shape[:, None], omega)[0]) / (modal_mass * 2 * float(omega[0]))


def find_partners(model: Model, stuck: MeasuredResonance, free: Sequence[MeasuredResonance]) -> list[MeasuredResonance]:
    """Find the resonances without contacts that correspond to a resonance with contacts.

    They belong to the free mode of the model whose mass-weighted shape is most similar to that of the stuck mode. If
    none was measured, the result is the free resonance with the nearest frequency.
    """
    if not free:
        return []
    system, plain = model.system, model.without_contacts().system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    own = compute_dense_modes(plain.mass, stick_at_rest(plain.stiffness, plain.joints))
    shape = modes.mode_shapes[:, _find_nearest(modes.frequency, stuck.frequency)]
    alike = (shape @ plain.mass @ own.mode_shapes) ** 2
    same = [item for item in free if _find_nearest(own.frequency, item.frequency) == int(np.argmax(alike))]
    return same or [free[_find_nearest(np.array([item.frequency for item in free]), stuck.frequency)]]


def _find_nearest(frequency: Float[NDArray[np.float64], " m"], wanted: float) -> int:
    """Index of the mode nearest to a frequency, by the logarithm of their ratio."""
    return int(np.argmin(np.abs(np.log(np.maximum(frequency, 1e-12) / wanted))))


def estimate_stiffness(
    model: Model, stuck: MeasuredResonance, free: MeasuredResonance | None, damping_factor: float
) -> Iterator[FirstEstimate]:
    """Estimate the tangential stiffness from the ratio of stuck to free frequency, if that of the model depends on it.

    Parameters
    ----------
    model
        Model with contacts.
    stuck
        Resonance with the contacts.
    free
        Resonance without them; if None, the model's modulus is assumed correct within the deviation of its prior.
    damping_factor
        Factor on the model's damping, measured without contacts [-]; damping beyond it is attributed to friction.
    """
    wanted, relative = stuck.frequency, stuck.frequency_deviation / stuck.frequency
    if free is None:
        relative = float(np.hypot(relative, DEVIATION["E"] / 2))  # a frequency is proportional to sqrt(E)
    else:
        plain = model.without_contacts().system
        own = compute_dense_modes(plain.mass, plain.stiffness).frequency
        nearest = float(own[_find_nearest(own, free.frequency)])
        if not 1 / MAX_FREQUENCY_FACTOR < nearest / free.frequency < MAX_FREQUENCY_FACTOR:
            return
        wanted *= nearest / free.frequency
        relative = float(np.hypot(relative, free.frequency_deviation / free.frequency))
    deviation = wanted * float(np.hypot(relative, LEAST_FREQUENCY))
    structural = damping_ratio(model, stuck)
    friction = stuck.damping - damping_factor * structural if structural is not None else 0.0
    softening = MOST_SOFTENING * friction if friction > 0 else 0.0
    places = []
    for factor in GRID:
        scaled = scale_contacts(model, dict.fromkeys(model.lines, float(factor)), CONTACT["kt"]).system
        modes = compute_dense_modes(scaled.mass, stick_at_rest(scaled.stiffness, scaled.joints))
        places.append(np.sort(modes.frequency))
    # Stiffer contacts raise every frequency, so that modes keep their order; the number is that at factor 1.
    drawn = places[int(np.argmin(np.abs(np.log(GRID))))]
    number = _find_nearest(drawn, wanted)
    curve = [frequencies[number] for frequencies in places]
    if not (np.diff(curve) >= 0).all() or curve[-1] / curve[0] < 1 + 10 * LEAST_FREQUENCY:
        return
    value, low, high = (
        float(np.interp(item, curve, GRID, left=0.0, right=np.inf))
        for item in (
            wanted * (1 + softening / 2),
            wanted - TWO_SIDED_95 * deviation,
            wanted * (1 + softening) + TWO_SIDED_95 * deviation,
        )
    )
    if not 0 < value < np.inf:
        return
    own_stiffness = float(
        sum(contact.tangential_stiffness for line in model.lines for contact in find_contacts(model, line))
    )
    yield FirstEstimate(
        parameter="kt",
        value=value * own_stiffness,
        interval=(low * own_stiffness, high * own_stiffness),
        unit="N/m",
        model_value=own_stiffness,
        source=stuck.source if free is None else f"{stuck.source} compared with {free.source}",
        bias=(SOFTENED, ALONE if free is None else OTHER),
    )
