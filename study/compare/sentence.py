"""Summary of a comparison in a few sentences for a structural dynamicist."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.special import chdtri

from correlation.campaign.measurement import Suspicion, name_configuration
from correlation.metric.misfit import Misfit, find_worst, find_worst_cell, split_misfit, summarise_misfit
from correlation.metric.peak_error import PeakError
from diagnosis.fit.unknown_gain import GAIN, describe_gain
from geometry.name_list import join_first_names
from geometry.plain_number import format_number
from study.compare.curve import name_harmonic
from study.compare.data import DataComparison, without_comparison
from study.compare.result import AGREES, DIFFERS, ComparisonResult
from study.compare.section.overview import describe_left_out
from study.merge_sentences import name_wrong_places

#: A resonance fails beyond this: of some twenty, one deviates by three by chance [standard deviations].
CLEAR_PEAK = 4.0
#: A change of frequency below this share of the other one counts as zero: a linear model shows round-off [-].
NO_CHANGE = 0.01
#: A random difference above this is no agreement [%]: sensors have errors of 5 %, means smaller ones unless all agree.
WIDE_DEVIATION = 10.0
#: Relative standard deviation from which a number is not determined [%].
NOT_DETERMINED = 100.0
#: Significance level [-].
CHANCE = 1e-3
#: A gain differs clearly from zero above this [standard deviations].
CLEAR_GAIN = 3.0
#: Percentages from here on are written without decimals [%].
PLAIN = 99.5
NEXT = (
    "A root mean square can hide a few states with large errors; stickslip diagnose says whether an effect is "
    "missing, and which."
)


@dataclass(frozen=True, kw_only=True)
class Summary:
    """Verdict of a comparison.

    Parameters
    ----------
    tone
        "nothing" if the model agrees, "ambiguous", or "missing" if it does not: colours of the page.
    tag, sentences, next
        The verdict in a few words and in sentences, and the next step.
    cards
        Key numbers with their names.
    """

    tone: str
    tag: str
    sentences: tuple[str, ...]
    next: str
    cards: tuple[tuple[str, str], ...]


def summarise(compared: ComparisonResult) -> Summary:
    """Verdict of a comparison."""
    difference = summarise_misfit(compared.train).whitened
    differing = _list_differing(compared.data)
    tone, tag = judge(difference, without_comparison(compared.data), compared.suspicions, differing)
    if tone != "missing" and (vague := _describe_wide_deviations(compared)):
        tone, tag = "ambiguous", f"The measurements are not sufficient to show whether the model agrees: {vague}"
        tag += qualify(compared.suspicions) + doubt(compared.suspicions)
    sides = {"training": compared.train} | ({} if compared.held_out is None else {"held-out": compared.held_out})
    cards = [
        (f"{name} data, reduced chi^2 (1 is noise)", format_square(summarise_misfit(side).whitened))
        for name, side in sides.items()
    ]
    summary = summarise_misfit(compared.train)
    if np.isfinite(summary.amplitude_error):
        cards.append(("median error of amplitude", f"{format_number(100 * summary.amplitude_error, 3)} %"))
    if np.isfinite(summary.phase_error):
        cards.append(("median error of phase", f"{format_number(np.degrees(summary.phase_error), 3)} deg"))
    return Summary(
        tone=tone,
        tag=tag,
        sentences=(
            _describe_overall(compared.train),
            *describe_resonances(
                compared.peaks, compared.campaign.drive.unit, agrees=difference <= AGREES, levels=_list_levels(compared)
            ),
            *_describe_worst(compared.train, compared.campaign.drive.unit),
            *describe_left_out(compared),
        ),
        next=NEXT,
        cards=tuple(cards),
    )


def judge(
    difference: float, missing: Sequence[str], suspicions: Sequence[Suspicion] = (), differing: Sequence[str] = ()
) -> tuple[str, str]:
    """Tone and headline.

    Parameters
    ----------
    difference
        Root of reduced chi-squared of all numbers together [-].
    missing
        Data that could not be compared.
    suspicions
        Suspicious measurements: agreement with these is no agreement with the specimen.
    differing
        Further data, not part of the difference, that disagree with the model.
    """
    tone = "nothing" if difference <= AGREES else "ambiguous" if difference <= DIFFERS else "missing"
    tag = {
        "nothing": "The model agrees with the measurements within noise and stated errors",
        "ambiguous": "The model is close to the measurements",
        "missing": "The model differs from the measurements",
    }[tone]
    if differing and tone != "missing":
        verb, word = ("agrees", "with") if tone == "nothing" else ("is close", "to")
        tag = f"The model {verb} {word} the steady states, but differs from {join_first_names(differing)}"
        tone = "missing"
    if missing:
        tone, tag = tone.replace("nothing", "ambiguous"), f"{tag} that could be compared; not {', '.join(missing)}"
    if any(not item.remark for item in suspicions):
        tone = tone.replace("nothing", "ambiguous")
    return tone, f"{tag}{qualify(suspicions)}{doubt(suspicions)}"


def qualify(suspicions: Sequence[Suspicion]) -> str:
    """Part of a headline: conditions of its verdict; empty without any."""
    return "".join(f"; {text}" for text in dict.fromkeys(item.headline for item in suspicions) if text)


def doubt(suspicions: Sequence[Suspicion]) -> str:
    """End of a headline: suspicious measurements; empty without any."""
    where = name_wrong_places(suspicions)
    return f", but some of these look wrong: {where}" if where else ""


def _list_differing(data: Sequence[DataComparison]) -> tuple[str, ...]:
    """Data with significant and clear differences, by the thresholds of steady states, with their sizes."""
    far = []
    for item in data:
        there = item.error[np.isfinite(item.error)]
        if item.root_mean_square > DIFFERS and (there**2).sum() > chdtri(len(there), CHANCE):
            far.append(f"{item.type} {item.name} ({item.root_mean_square:.3g} standard deviations)")
    return tuple(far)


def _describe_wide_deviations(compared: ComparisonResult) -> str:
    """Why standard deviations are too wide for a verdict of agreement; empty if they are not."""
    summary = summarise_misfit(compared.train)
    if not isfinite(summary.amplitude_error):
        return "no reading exceeds the scatter between its repeats"
    errors = {
        f"amplitude is {format_percent(summary.amplitude_error)} %": summary.amplitude_error,
        # An angle in radians is the error perpendicular to the value, relative to it.
        f"phase is {format_number(np.degrees(summary.phase_error))} deg": summary.phase_error,
    }
    for words, error in errors.items():
        if 100 * error > WIDE_DEVIATION:
            return f"the median error of the {words}, and standard deviations are as wide"
    for item in compared.calibrated:
        if item.name.startswith(GAIN) and not abs(item.factor) > CLEAR_GAIN * item.deviation:
            return f"the {describe_gain(item.name, item.factor, item.deviation)} does not differ clearly from zero"
    return ""


def _describe_overall(misfit: Misfit) -> str:
    summary = summarise_misfit(misfit)
    noise = (
        f"{summary.whitened:.3g} times as large as expected from noise, friction histories and numerical error (root "
        "of reduced chi^2)"
    )
    if not np.isfinite(summary.amplitude_error):
        return f"All together the differences are {noise}; no reading exceeds the noise."
    phase = (
        f" and of the phase {format_number(np.degrees(summary.phase_error))} deg"
        if np.isfinite(summary.phase_error)
        else ""
    )
    amplitude = f"the median error of the amplitude is {format_percent(summary.amplitude_error)} %"
    return f"All together the differences are {noise}; {amplitude}{phase}."


def _list_levels(compared: ComparisonResult) -> dict[bool, tuple[float, ...]]:
    """Levels that were compared, by whether the structure was free."""
    points = compared.train.points
    return {free: tuple(np.unique(points.level[points.free == free]).tolist()) for free in (False, True)}


def describe_resonances(
    peaks: Sequence[PeakError],
    unit: str = "N",
    *,
    agrees: bool = True,
    levels: Mapping[bool, Sequence[float]] | None = None,
) -> Iterator[str]:
    """Per configuration and mode: frequency and damping, and their changes with the level.

    Parameters
    ----------
    peaks
        Errors of the resonances.
    unit
        Unit of the levels.
    agrees
        Whether the points themselves agree with the model: if not, no error of a resonance is attributed to chance.
    levels
        Measured levels, by whether the structure was free; those without a resonance are reported.
    """
    for (free, _), every in group_modes(peaks).items():
        name = f"resonance of the {name_configuration(free)} structure{name_mode(every, peaks)}"
        listed = [peak for peak in every if np.isfinite(peak.predicted_frequency)]
        if not listed:
            yield f"The model has no resonance in the measured band that belongs to the {name}."
            continue
        frequency = _describe_range(
            [100 * peak.frequency_error for peak in listed],
            [abs(peak.predicted_frequency - peak.frequency) / peak.frequency_deviation for peak in listed],
            [peak.frequency_deviation / peak.frequency for peak in listed],
            listed,
            unit,
            agrees,
        )
        damping = _describe_range(
            [100 * peak.damping_error for peak in listed],
            [abs(peak.predicted_damping - peak.damping) / peak.damping_deviation for peak in listed],
            [peak.damping_deviation / peak.damping for peak in listed],
            listed,
            unit,
            agrees,
        )
        read = [peak.level for peak in listed]
        only = f" (read at {_join_levels(read)} {unit} only)" if set((levels or {}).get(free, ())) - set(read) else ""
        yield f"The {name}{only} {frequency}; its damping {damping}."
        yield from _describe_softening(listed, free, unit)


def group_modes(peaks: Iterable[PeakError]) -> dict[tuple[bool, int], list[PeakError]]:
    """Peaks by whether the structure was free and by mode, each by ascending level."""
    modes: dict[tuple[bool, int], list[PeakError]] = {}
    for peak in sorted(peaks, key=lambda peak: (peak.free, peak.mode, peak.level)):
        modes.setdefault((peak.free, peak.mode), []).append(peak)
    return modes


def name_mode(mode: Sequence[PeakError], peaks: Iterable[PeakError]) -> str:
    """`` near 30.1 Hz`` for a mode whose configuration has others among the peaks; otherwise empty."""
    if all(peak.mode == mode[0].mode for peak in peaks if peak.free == mode[0].free):
        return ""
    return f" near {np.mean([peak.frequency for peak in mode]):.3g} Hz"


def _join_levels(levels: Sequence[float]) -> str:
    return ", ".join(f"{level:g}" for level in levels)


def _describe_range(
    errors: Sequence[float],
    deviations: Sequence[float],
    resolution: Sequence[float],
    peaks: Sequence[PeakError],
    unit: str,
    agrees: bool,
) -> str:
    """Errors over the levels in words [%], their sizes in standard deviations, and these deviations [-]."""
    if not np.isfinite(deviations).any():
        low, high = (format_number(end, sign="+") for end in (min(errors), max(errors)))
        return f"is off by {low} to {high} %, with an unknown standard deviation"
    clear = [number for number, size in enumerate(deviations) if size > CLEAR_PEAK]
    if not clear:
        largest = max(map(abs, errors))
        known = [size for size in deviations if np.isfinite(size)]
        if sum(size**2 for size in known) > chdtri(len(known), CHANCE):
            off = f"is off by up to {format_number(largest)} %"
            return f"{off}: significant over all levels together, but at no single level"
        if agrees and largest < WIDE_DEVIATION:
            return f"agrees within {format_number(largest)} %, which chance explains"
        # If the points themselves disagree, a bent or truncated peak has a deviation that hides any error.
        coarsest = 100 * float(np.nanmax(resolution))
        remark = (
            f" (one standard deviation: up to {format_number(coarsest)} %)"
            if coarsest < NOT_DETERMINED
            else ", but the readings do not determine it"
        )
        return f"differs by up to {format_number(largest)} %{remark}"
    least, most = min(errors[number] for number in clear), max(errors[number] for number in clear)
    where = "" if len(clear) == len(peaks) else f" at {_join_levels([peaks[number].level for number in clear])} {unit}"
    if least * most < 0:
        return f"is off by {format_number(least, sign='+')} to {format_number(most, sign='+')} %{where}"
    word = "high" if most > 0 else "low"
    small, large = sorted((abs(least), abs(most)))
    return f"is {_from_to(small, large)} % too {word}{where}"


def _from_to(first: float, last: float) -> str:
    """Both ends of a range, or one number if both are formatted alike."""
    ends = format_number(first), format_number(last)
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _change_of_damping(first: float, last: float) -> tuple[str, str]:
    """Change of a damping ratio with the level in words: a verb, and the rest."""
    ends = _from_to(100 * first, 100 * last)
    return ("goes", f"from {ends} %") if " to " in ends else ("stays", f"at {ends} %")


def _describe_softening(peaks: Sequence[PeakError], free: bool, unit: str) -> Iterator[str]:
    """Change from the lowest to the highest level, measured and predicted, if significant."""
    first, last = peaks[0], peaks[-1]
    if free or len(peaks) < 2:
        return
    measured, predicted = (last.frequency - first.frequency), (last.predicted_frequency - first.predicted_frequency)
    chance = float(np.hypot(first.frequency_deviation, last.frequency_deviation))
    if abs(measured) < CLEAR_PEAK * chance and abs(predicted) < CLEAR_PEAK * chance:
        return
    largest = max(abs(measured), abs(predicted))
    of_specimen, of_model = (_describe_change(change, largest) for change in (measured, predicted))
    of_model = of_model.removeprefix(f"{of_specimen.partition(' ')[0]} ")
    verb, measured_damping = _change_of_damping(first.damping, last.damping)
    verb_of_model, predicted_damping = _change_of_damping(first.predicted_damping, last.predicted_damping)
    like = "" if verb == verb_of_model else f"{verb_of_model} "
    sentence = (
        f"From {first.level:g} to {last.level:g} {unit} it {of_specimen} in the measurement and {of_model} in the model"
        f", and the damping ratio {verb} {measured_damping} in the measurement and {like}{predicted_damping} in "
        "the model"
    )
    if abs(predicted - measured) > CLEAR_PEAK * chance:
        sentence += f": {_compare_trends(measured, predicted)}"
    yield f"{sentence}."


def _describe_change(change: float, largest: float) -> str:
    """A change of a frequency in words [Hz]; "stays" for a small share of the largest."""
    if abs(change) < NO_CHANGE * largest:
        return "stays"
    return f"{'falls' if change < 0 else 'rises'} by {abs(change):.3g} Hz"


def _compare_trends(measured: float, predicted: float) -> str:
    """Whether the model softens or hardens more or less with the level than the specimen, from changes of frequency."""
    if abs(predicted) < NO_CHANGE * abs(measured):
        return f"the model does not {'soften' if measured < 0 else 'harden'} with the level"
    if measured * predicted < 0:
        ways = ("softens" if change < 0 else "hardens" for change in (predicted, measured))
        return "the model {} with the level, the specimen {}".format(*ways)
    verb = "softens" if measured + predicted < 0 else "hardens"
    return f"the model {verb} {'more' if abs(predicted) > abs(measured) else 'less'} with the level than the specimen"


def format_square(size: float) -> str:
    """The square of a root mean square, with three digits or as a whole number."""
    return f"{size**2:,.0f}" if size**2 >= PLAIN else f"{size**2:.3g}"


def format_percent(ratio: float) -> str:
    """The size of a ratio in percent."""
    return format_number(100 * abs(ratio))


def _describe_worst(misfit: Misfit, unit: str) -> Iterator[str]:
    """The worst sensor and the worst place, if they exceed the noise."""
    cell, points = find_worst_cell(misfit)
    if not cell.deviations > DIFFERS:
        return
    sensors = split_misfit(misfit, "sensor")
    sensor = f"The worst sensor is {find_worst(sensors).label}. " if len(sensors) > 1 else ""
    low, high = points.frequency.min(), points.frequency.max()
    harmonic = int(points.harmonic[0])
    part = name_harmonic(harmonic) if harmonic else "static part"
    where = f"the {part} of {points.sensor[0]} at {points.level[0]:g} {unit}, {low:.5g} to {high:.5g} Hz"
    size = ""
    if np.isfinite(cell.signed_amplitude_error):
        size = f": the prediction is {format_percent(cell.signed_amplitude_error)} % too "
        size += "large" if cell.signed_amplitude_error > 0 else "small"
        phase = np.degrees(cell.signed_phase_error)
        if harmonic and abs(phase) >= 0.1:
            size += f" and {'leads' if phase > 0 else 'lags'} by {format_number(abs(phase))} deg"
    yield f"{sensor}The model is worst at {where}{size} ({cell.deviations:.3g} standard deviations of a point)."
