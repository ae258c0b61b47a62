"""First estimates of a friction-damped structure from what a campaign holds, each with interval and known bias.

They are section 4.1 of the paper: the tangential stiffness from the stick branch of a loop, the friction coefficient
from the largest ratio of tangential to normal force, the preload from static forces, the damping from the lowest level.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 4.1.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import brentq

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Measurement
from correlation.data_type.frequency_response import MeasuredResponse
from correlation.data_type.loop import ForceLoop
from correlation.data_type.mode import MeasuredMode, linear_modes
from correlation.data_type.ring_down import FreeDecay
from correlation.errors import CampaignError
from correlation.modal.backbone import fit_peak
from correlation.model import Model
from correlation.signal.stick_slip import estimate_stick_slip
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from diagnosis.fit.calibration_parameter import DEVIATION

#: Half a 95 % interval in standard deviations.
TWO = 1.96
#: Instants of a period at which T / N is taken, and the share of the mean of N below which small errors of N would make
#: the ratio.
INSTANTS, LOADED = 256, 0.5
#: A sum of few harmonics of a force that slips overshoots it by up to this factor: the fundamental of a square wave.
OVERSHOOT = 4 / np.pi
#: Frequencies below belong to rigid bodies [Hz].
RIGID = 0.5
#: Factors of the stiffness of all contacts between which the stuck resonance is looked for [-].
FACTORS = (0.05, 20.0)


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A first value.

    Parameters
    ----------
    parameter
        "kt", "mu", "preload" or "zeta".
    where
        Contact line, or configuration for the damping.
    value, low, high
        Value and 95 % interval [SI]; an infinite end for a bound.
    unit
        SI unit; "-" for a ratio.
    in_case
        What the case says [SI]; NaN where it says nothing.
    source
        What it was read from.
    bias
        Known biases, in words.
    """

    parameter: str
    where: str
    value: float
    low: float
    high: float
    unit: str
    in_case: float
    source: str
    bias: tuple[str, ...]

    @property
    def factor(self) -> float:
        """Value over that of the case [-]; NaN where the case has none."""
        return self.value / self.in_case if self.in_case else np.nan


def estimate_all(campaign: Campaign, model: Model) -> tuple[tuple[Estimate, ...], tuple[str, ...]]:
    """All first estimates that a campaign allows, and what to measure for the others.

    Parameters
    ----------
    campaign
        Measured campaign.
    model
        Model of the case with its sensors, nothing calibrated.
    """
    found = [*_from_loops(campaign, model), *_from_forces(campaign, model), *_damping(campaign, model)]
    names = {item.parameter for item in found}
    if "kt" not in names:
        found += _stiffness_from_resonances(campaign, model)
        names = {item.parameter for item in found}
    missing = [text for name, text in MISSING.items() if name not in names and (model.lines or name == "zeta")]
    return tuple(found), tuple(missing)


MISSING = {
    "kt": "kt: measure a loop of a contact line ([[loop]]), or the resonance of the structure with and without its "
    "contacts at the lowest level",
    "mu": "mu: measure tangential and normal force of a line with harmonics 0 and 1, or loops in gross slip",
    "preload": "preload: measure the static part (harmonic 0) of the normal force of a line at the lowest level",
    "zeta": "zeta: measure a resonance at a level so low that the contacts stick, without contacts, or a ring-down",
}


def line_stiffness(model: Model, line: str) -> float:
    """Tangential stiffness of all contacts of a line together [N/m]."""
    return float(sum(contact.tangential_stiffness for contact in find_contacts(model, line)))


def _from_loops(campaign: Campaign, model: Model) -> Iterator[Estimate]:
    for datum in campaign.data:
        if not isinstance(datum, ForceLoop):
            continue
        line = datum.line if datum.line in model.lines else None
        try:
            reading = estimate_stick_slip(datum.displacement, datum.force)
        except CampaignError:
            continue
        bias = ["whatever is elastic between the two points of measurement is part of it: biased low"]
        if line is not None:
            bias = ["a laser that leans sees less than the whole displacement: biased high"]
        stiffness = reading.tangential_stiffness
        yield Estimate(
            parameter="kt", where=line or str(datum.place), value=stiffness.value, low=stiffness.interval[0],
            high=stiffness.interval[1], unit="N/m",
            in_case=line_stiffness(model, line) if line is not None else np.nan,
            source=f'stick branch of loop "{datum.name}"', bias=(*bias, *reading.suspicions),
        )  # fmt: skip


def _from_forces(campaign: Campaign, model: Model) -> Iterator[Estimate]:
    """Friction coefficient and preload of each line whose forces were measured."""
    table = campaign.measurement
    for line in model.lines:
        contacts = find_contacts(model, line)
        number = {
            item.component: place
            for place, item in enumerate(campaign.sensors)
            if item.quantity == CONTACT_FORCE and item.line == line and item.calibrated
        }
        if "normal" not in number:
            continue
        normal = table.where(table.sensor == number["normal"])
        static = normal.where(normal.harmonic == 0)
        if len(static):
            low = static.where(static.level == static.level.min())
            values = np.array([low.value.real[low.repeat == repeat].mean() for repeat in np.unique(low.repeat)])
            yield _scattered(
                "preload", line, values, "N", sum(contact.preload for contact in contacts),
                f"static normal force at {low.level[0]:g} N",
                ("depends on the friction history of the assembly", "offset of the load cells is part of it"),
            )  # fmt: skip
        if "tangential" in number:
            ratios, swing = _force_ratios(table.where(table.sensor == number["tangential"]), normal)
            if len(ratios):
                value = float(np.median(ratios))
                spread = float(np.std(ratios, ddof=1)) if len(ratios) > 1 else 0.0
                yield Estimate(
                    parameter="mu", where=line, value=value,
                    low=value / OVERSHOOT / (1 + swing) - TWO * spread, high=np.inf, unit="-",
                    in_case=float(np.mean([contact.friction_coefficient for contact in contacts])),
                    source=f"largest |T/N| over the period, median of {len(ratios)} repeats",
                    bias=(
                        "a lower bound: that the whole line slips is not certain",
                        "few harmonics of a force that slips overshoot it by up to 27 %, and the normal force swings "
                        f"by {100 * swing:.0f} % of its mean: the interval has both",
                        "sums over the line: single contacts may slip at another ratio",
                    ),
                )  # fmt: skip


def _force_ratios(tangential: Measurement, normal: Measurement) -> tuple[Float[NDArray[np.float64], " r"], float]:
    """Largest |T / N| of each repeat, shape (r,), and the largest swing of N there over its mean [-].

    States without the mean of N are left out.
    """
    largest: dict[int, float] = {}
    swing = 0.0
    states: dict[tuple[int, int, int, float, float], list[dict[int, complex]]] = {}
    for side, rows in enumerate((tangential, normal)):
        keys = zip(rows.test.tolist(), rows.repeat.tolist(), rows.sweep.tolist(), rows.level.tolist(),
                   rows.frequency.tolist(), strict=True)  # fmt: skip
        for key, harmonic, value in zip(keys, rows.harmonic.tolist(), rows.value.tolist(), strict=True):
            states.setdefault(key, [{}, {}])[side][harmonic] = value
    for key, (t, n) in states.items():
        if 1 not in t or 0 not in n:
            continue
        force, load = _over_a_period(t), _over_a_period(n)
        loaded = load > LOADED * load.mean()
        if loaded.any() and load.mean() > 0:
            ratio = float(np.abs(force[loaded] / load[loaded]).max())
            repeat = int(key[1])
            if ratio > largest.get(repeat, 0.0):
                largest[repeat] = ratio
                swing = max(swing, float(np.ptp(load)) / 2 / float(load.mean()))
    return np.array([*largest.values()]), swing


def _over_a_period(harmonics: dict[int, complex]) -> Float[NDArray[np.float64], " i"]:
    phase = 2 * np.pi * np.arange(INSTANTS) / INSTANTS
    return np.asarray(sum((value * np.exp(1j * number * phase)).real for number, value in harmonics.items()))


def _damping(campaign: Campaign, model: Model) -> Iterator[Estimate]:
    """Damping ratio of the structure: free of its contacts if that was tested, else at the smallest amplitude."""
    for peak in lowest_peaks(campaign):
        bias: tuple[str, ...] = ("the support, cables and the stinger damp, too",)
        if not peak.is_free and model.lines:
            bias = ("contacts that slip already at this level are part of it: biased high", *bias)
        yield Estimate(
            parameter="zeta", where=peak.configuration, value=peak.damping,
            low=peak.damping - TWO * peak.damping_spread,
            high=peak.damping + TWO * peak.damping_spread, unit="-",
            in_case=_model_damping(model, peak.configuration, peak.frequency), source=peak.source, bias=bias,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LowestPeak:
    """The resonance of a configuration at its lowest level [Hz, -]."""

    configuration: str
    frequency: float
    spread: float
    damping: float
    damping_spread: float
    source: str

    @property
    def is_free(self) -> bool:
        """Whether it is that of the structure without its contacts."""
        return self.configuration == "free"


def lowest_peaks(campaign: Campaign) -> list[LowestPeak]:
    """Resonances of both configurations at their lowest levels, from whatever shows them."""
    found = [*_swept_peaks(campaign)]
    for datum in campaign.data:
        modes = (
            datum.modes if isinstance(datum, MeasuredResponse) else [datum] if isinstance(datum, MeasuredMode) else []
        )
        if modes and np.isfinite(modes[0].damping):
            mode = min(modes, key=lambda item: item.frequency)
            found.append(
                LowestPeak(
                    configuration=mode.configuration, frequency=mode.frequency, spread=mode.frequency_deviation,
                    damping=mode.damping, damping_spread=mode.damping_deviation, source=f'mode of "{datum.name}"',
                )
            )  # fmt: skip
        if isinstance(datum, FreeDecay) and datum.modes:
            decay = min(datum.modes, key=lambda item: float(np.median(item.frequency)))
            # The end of a decay is the least certain part of its curve.
            row = int(np.argmin(np.abs(decay.amplitude - decay.amplitude.min() ** 0.8 * decay.amplitude.max() ** 0.2)))
            found.append(
                LowestPeak(
                    configuration=datum.configuration, frequency=float(decay.frequency[row]),
                    spread=float(decay.frequency_deviation[row]), damping=float(decay.damping_ratio[row]),
                    damping_spread=float(decay.damping_deviation[row]),
                    source=f'end of ring-down "{datum.name}", {decay.amplitude[row]:.3g} {datum.unit}',
                )
            )  # fmt: skip
    return found


def _swept_peaks(campaign: Campaign) -> Iterator[LowestPeak]:
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests], dtype=bool)
    moves = np.array([item.quantity != CONTACT_FORCE for item in campaign.sensors], dtype=bool)
    for configuration in ("free", "jointed"):
        rows = (free[table.test] == (configuration == "free")) & moves[table.sensor] & (table.harmonic == 1)
        if not rows.any():
            continue
        here = table.where(rows & (table.level == table.level[rows].min()))
        sensor = max(np.unique(here.sensor), key=lambda item: float(np.abs(here.value[here.sensor == item]).mean()))
        here = here.where(here.sensor == sensor)
        peaks = []
        for repeat in np.unique(here.repeat):
            one = here.where(here.repeat == repeat)
            frequency, place = np.unique(one.frequency, return_inverse=True)
            amplitude = np.bincount(place, np.abs(one.value) / one.force) / np.bincount(place)
            try:
                peaks.append(fit_peak(frequency, amplitude, None, campaign.sensors[sensor].quantity))
            except CampaignError:
                continue
        if peaks:
            numbers = np.array(peaks)
            count = len(numbers)
            scatter = numbers.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.zeros(numbers.shape[1])
            yield LowestPeak(
                configuration=configuration, frequency=float(numbers[:, 2].mean()),
                spread=float(np.hypot(scatter[2], numbers[:, 3].mean() / np.sqrt(count))),
                damping=float(numbers[:, 4].mean()),
                damping_spread=float(np.hypot(scatter[4], numbers[:, 5].mean() / np.sqrt(count))),
                source=f"resonance at the lowest level, {here.level[0]:g} {campaign.drive.unit}, {count} repeats",
            )  # fmt: skip


def _model_damping(model: Model, configuration: str, frequency: float) -> float:
    own, damping, _ = linear_modes(model, configuration)
    elastic = own > RIGID
    return float(damping[elastic][np.argmin(np.abs(np.log(own[elastic] / frequency)))]) if elastic.any() else np.nan


def _stiffness_from_resonances(campaign: Campaign, model: Model) -> Iterator[Estimate]:
    """Tangential stiffness at which the stuck model has the measured resonance, its modulus set by the free test."""
    peaks = {peak.configuration: peak for peak in reversed(lowest_peaks(campaign))}
    if not model.lines or "jointed" not in peaks:
        return
    # Frequencies go with the root of the modulus.
    base, spread = model, float(np.hypot(peaks["jointed"].spread, DEVIATION["E"] / 2 * peaks["jointed"].frequency))
    words = "the modulus of the case is taken as right within 1 %: measure the structure without its contacts, too"
    if "free" in peaks:
        own = linear_modes(model, "free")[0]
        elastic = own[own > RIGID]
        nearest = float(elastic[np.argmin(np.abs(np.log(elastic / peaks["free"].frequency)))])
        whole = np.sum([part.stiffness for part in model.parts], axis=0)
        base = model.with_system(
            stiffness=model.system.stiffness + ((peaks["free"].frequency / nearest) ** 2 - 1) * whole
        )
        words = "the modulus is set by the resonance without contacts"
        spread = float(np.hypot(peaks["jointed"].spread, peaks["free"].spread))
    jointed = peaks["jointed"]
    stuck = linear_modes(base, "jointed")[0]
    above = np.flatnonzero(stuck > RIGID)
    mode = int(above[np.argmin(np.abs(np.log(stuck[above] / jointed.frequency)))])
    factors = [_factor_at(base, mode, jointed.frequency + side * TWO * spread) for side in (-1, 0, 1)]
    if factors[1] is None:
        return
    low, high = factors[0] or 0.0, factors[2] or np.inf
    for line in model.lines:
        own_stiffness = line_stiffness(model, line)
        yield Estimate(
            parameter="kt", where=line, value=factors[1] * own_stiffness, low=low * own_stiffness,
            high=high * own_stiffness, unit="N/m", in_case=own_stiffness,
            source="stuck resonance of the model at the lowest level, all lines by one factor",
            bias=("contacts that slip already at this level: biased low", words),
        )  # fmt: skip


def _factor_at(model: Model, mode: int, frequency: float) -> float | None:
    """Factor on the tangential stiffness of all contacts at which a mode has a frequency; None if none has."""

    def beyond(logarithm: float, wanted: float) -> float:
        changed = scale_contacts(model, dict.fromkeys(model.lines, float(np.exp(logarithm))), "tangential_stiffness")
        return float(linear_modes(changed, "jointed")[0][mode]) - wanted

    low, high = np.log(FACTORS)
    if beyond(low, frequency) * beyond(high, frequency) > 0:
        return None
    return float(np.exp(brentq(partial(beyond, wanted=frequency), low, high, xtol=1e-4)))


def _scattered(
    parameter: str, where: str, values: Float[NDArray[np.float64], " r"], unit: str, in_case: float, source: str,
    bias: tuple[str, ...],
) -> Estimate:  # fmt: skip
    """A mean of repeats with the interval of their scatter."""
    mean = float(values.mean())
    half = TWO * float(values.std(ddof=1)) if len(values) > 1 else np.inf
    return Estimate(
        parameter=parameter, where=where, value=mean, low=mean - half, high=mean + half, unit=unit, in_case=in_case,
        source=f"{source}, {len(values)} repeats", bias=bias,
    )  # fmt: skip


def combine(estimates: tuple[Estimate, ...], parameter: str) -> Estimate | None:
    """One factor for all lines, as the calibration parameters have it; None without an estimate beside the case.

    Parameters
    ----------
    estimates
        All estimates.
    parameter
        "kt", "mu" or "zeta".
    """
    usable = [
        item for item in estimates if item.parameter == parameter and np.isfinite(item.factor) and item.factor > 0
    ]
    if parameter == "zeta":
        usable = [item for item in usable if item.where == "free"] or usable
    if not usable:
        return None
    best = min(usable, key=lambda item: (item.high - item.low) / item.value if np.isfinite(item.high) else np.inf)
    factor = float(np.median([item.factor for item in usable]))
    return replace(best, value=factor * best.in_case)
