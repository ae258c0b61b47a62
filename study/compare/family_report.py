"""Families over limits in words and as a document."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtr

from correlation.campaign.measurement import SWEEPS
from correlation.family.verdict import OUTSIDE, Departure, FamilyVerdict
from geometry.plain_number import format_number
from study.compare.families import FamilyCalibration, FamilyComparison
from study.compare.family_limits import FamilyLimits
from study.compare.family_pictures import SYMBOL
from study.compare.section.section import Section
from study.page.table import Table

#: Number of departures listed per family.
LISTED = 3
#: A band with a smaller tightness is closed.
NO_WIDTH = 1e-3
WAY = SWEEPS | {0: "not swept"}


def format_family_report(comparison: FamilyComparison) -> list[str]:
    """Comparison as text."""
    lines = ["Measured families over the limits of all friction histories:"]
    if comparison.verdicts:
        lines += [*_format_table(comparison), "", *(f"  {item}" for item in _describe_verdict(comparison))]
        lines += [f"  {item}" for item in _describe_certainty(comparison)]
    if comparison.calibration is not None:
        lines += ["", *_format_calibration(comparison, comparison.calibration), ""]
    for sentence in comparison.not_compared:
        lines.append(f"  not compared: {sentence}")
    return [*lines, ""]


def document_families(comparison: FamilyComparison) -> dict[str, Any]:
    """Comparison for ``--json``, in SI units."""
    errors, limits = comparison.errors, comparison.limits
    document: dict[str, Any] = {
        "all_within": bool(comparison.verdicts) and not any(item.leaves_band for item in comparison.verdicts),
        "sentences": list(_describe_verdict(comparison)) if comparison.verdicts else [],
        "not_compared": list(comparison.not_compared),
        "families": [_document_family(item) for item in comparison.verdicts],
        "files": [str(file) for file in comparison.files],
        "calibration": None if comparison.calibration is None else _document_calibration(comparison),
    }
    if errors is not None and limits is not None:
        document |= {
            "frequency_jitter": errors.frequency,
            "noise": {
                f"{sensor}, harmonic {harmonic}": {
                    "relative": item.relative, "absolute": item.absolute, "source": item.source,
                }
                for (sensor, harmonic), item in errors.noise.items()
            },
            "reach_m": {
                f"{level:g}": row.tolist() for level, row in zip(limits.levels, limits.reach, strict=True)
            },
            "n_sampled": limits.n_sampled,
        }  # fmt: skip
    return document


def make_family_sections(comparison: FamilyComparison) -> Iterator[Section]:
    """Sections of the page: the verdict with all numbers, and the figures."""
    sentences = [*(_describe_verdict(comparison) if comparison.verdicts else ()), *comparison.not_compared]
    head = ("sensor", f"level [{comparison.level_unit}]", "readings", "coverage", "tightness", "score", "outside")
    table = Table(head=head, rows=[row for row, _ in _format_rows(comparison)]) if comparison.verdicts else None
    figures = {file.stem.partition("_families_")[2]: file.read_bytes() for file in comparison.files}
    yield Section(
        title="Measured families over the limits of all friction histories",
        text=" ".join(f"{item.rstrip('.')}." for item in sentences), table=table, pictures=figures,
    )  # fmt: skip


def _document_family(verdict: FamilyVerdict) -> dict[str, Any]:
    family = verdict.family
    return {
        "sensor": family.sensor,
        "harmonic": family.harmonic,
        "level": family.level,
        "n_curve": len(family.curves),
        "n_point": family.n_point,
        "n_compared": verdict.n_compared,
        "coverage": verdict.coverage,
        "tightness": verdict.tightness,
        "interval_score": verdict.score,
        "n_outside": len(verdict.departures),
        "leaves": verdict.leaves_band,
        "departures": [_document_departure(item) for item in verdict.departures[:LISTED]],
    }


def _document_departure(item: Departure) -> dict[str, Any]:
    return {
        "test": item.test,
        "repeat": item.repeat,
        "sweep": WAY[item.sweep],
        "frequency_hz": item.frequency,
        "side": item.side,
        "value": item.value,
        "limit": item.limit,
        "standard_deviations": item.deviations,
    }


def _format_table(comparison: FamilyComparison) -> Iterator[str]:
    rows = list(_format_rows(comparison))
    width = max(len(row[0]) for row, _ in rows)
    head = f"level [{comparison.level_unit}]"
    wide = max(len(head), 8)
    yield f"  {'':<{width}}  {head:>{wide}}  {'readings':>8}  {'coverage':>8}  {'tightness':>9}  {'score':>7}  outside"
    for (name, level, readings, inside, tight, score, outside), item in rows:
        leaves = ", leaves its limits" if item.leaves_band else ""
        yield (
            f"  {name:<{width}}  {level:>{wide}}  {readings:>8}  {inside:>8}  {tight:>9}  {score:>7}  {outside}{leaves}"
        )


def _format_rows(comparison: FamilyComparison) -> Iterator[tuple[tuple[str, ...], FamilyVerdict]]:
    for item in comparison.verdicts:
        yield (
            (
                _name(comparison, item), f"{item.family.level:.4g}", str(item.n_compared), _format_share(item.coverage),
                _number(item.tightness), _number(item.score), str(len(item.departures)),
            ),
            item,
        )  # fmt: skip


def _name(comparison: FamilyComparison, verdict: FamilyVerdict) -> str:
    sensor = next(item for item in comparison.sensors if item.name == verdict.family.sensor)
    if sensor.line is None:
        return sensor.name
    kind = "static" if verdict.family.harmonic == 0 else "dynamic"
    return f"{SYMBOL[str(sensor.component)]} of {sensor.line}, {kind}"


def _describe_verdict(comparison: FamilyComparison) -> Iterator[str]:
    verdicts = comparison.verdicts
    leaving = [item for item in verdicts if item.leaves_band]
    compared = [item for item in verdicts if item.n_compared]
    few = sum(len(item.departures) for item in compared if not item.leaves_band)
    total = sum(item.n_compared for item in compared)
    if not compared:
        yield "No reading lies at frequencies of the limits."
        return
    if not leaving:
        yield f"{_describe_curves(compared)} within the predicted limits at {_levels(comparison, compared)}."
        if few:
            yield (
                f"{few} of {total} readings lie outside by more than {OUTSIDE:g} standard deviations, which noise "
                "explains by number and size."
            )
    for name in dict.fromkeys(_name(comparison, item) for item in leaving):
        yield _describe_leaving(comparison, name, [item for item in leaving if _name(comparison, item) == name])
    if leaving and len(leaving) < len(compared):
        rest = [item for item in compared if not item.leaves_band]
        yield f"The other {len(rest)} of {len(compared)} families lie within their limits."


def _describe_leaving(comparison: FamilyComparison, name: str, leaving: Sequence[FamilyVerdict]) -> str:
    """Sentence on one sensor and harmonic, with the levels at which it leaves its limits."""
    verdict = max(leaving, key=lambda item: item.departures[0].deviations)
    worst, unit = verdict.departures[0], comparison.level_unit
    count = sum(len(item.departures) for item in leaving)
    total = sum(item.n_compared for item in leaving)
    side = "above the upper" if worst.side == "upper" else "below the lower"
    where = f"repeat {worst.repeat}" + (f", sweep {WAY[worst.sweep]}" if worst.sweep else "")
    repeats = sorted({item.repeat for one in leaving for item in one.departures})
    listed = "all repeats" if len(repeats) == len({c.repeat for c in verdict.family.curves}) else _join_items(repeats)
    size = abs(worst.limit)
    si = next(item.unit for item in comparison.sensors if item.name == verdict.family.sensor)
    by = (
        f"{format_number(100 * worst.distance / size, 3)} % of it"
        if size > worst.distance
        else f"{worst.distance:.3g} {si}"
    )
    return (
        f"{name} leaves its limits at {_levels(comparison, leaving)} ({count} of {total} readings, in {listed}); the "
        f"most significant one lies {by} {side} limit at {verdict.family.level:g} {unit} and {worst.frequency:.6g} Hz "
        f"({where}), {worst.deviations:.3g} standard deviations, {_describe_chance(worst, verdict)}."
    )


def _describe_chance(worst: Departure, verdict: FamilyVerdict) -> str:
    chance = 2 * ndtr(-worst.deviations) * verdict.n_compared
    if worst.deviations <= verdict.critical_deviation:
        return "which could be noise for one reading, but not for so many"
    if chance < 1e-6:
        return "which noise does not explain"
    return f"which noise exceeds in a family with a probability of {chance:.1g}"


def _describe_curves(compared: Sequence[FamilyVerdict]) -> str:
    repeats = {curve.repeat for item in compared for curve in item.family.curves}
    ways = {curve.sweep for item in compared for curve in item.family.curves}
    count = "The one repeat" if len(repeats) == 1 else f"All {len(repeats)} repeats"
    both = " and both sweeps" if {1, -1} <= ways else ""
    verb = "lies" if len(repeats) == 1 and not both else "lie"
    return f"{count}{both} {verb}"


def _levels(comparison: FamilyComparison, compared: Sequence[FamilyVerdict]) -> str:
    levels = [f"{level:g}" for level in sorted({item.family.level for item in compared})]
    return f"{_join_items(levels, bare=True)} {comparison.level_unit}"


def _join_items(items: Sequence[Any], *, bare: bool = False) -> str:
    words = [str(item) for item in items]
    joined = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
    return joined if bare else f"repeat{'s' if len(words) > 1 else ''} {joined}"


def _describe_certainty(comparison: FamilyComparison) -> Iterator[str]:
    errors, limits = comparison.errors, comparison.limits
    assert errors is not None
    assert limits is not None
    reach = _reach(limits, comparison.level_unit)
    yield (
        f"The limits hold for friction histories that displace sliders {reach} ([limits] reach); of "
        f"{limits.n_sampled:.0f} random histories per frequency and level none lies outside."
    )
    gain = max((item.gain for item in errors.noise.values()), default=0.0)
    of_gain = f", of the gain of its repeat (up to {format_number(100 * gain)} %)" if gain else ""
    pressed = max((float(np.abs(item).max(initial=0.0)) for item in comparison.preloads.values()), default=0.0)
    yield (
        f"A reading is outside if it is beyond a limit by more than {OUTSIDE:g} standard deviations of its noise"
        f"{of_gain} and of the model's numerical error. The frequency offset of each set-up (standard deviation "
        f"{format_number(100 * errors.frequency)} %) and its preloads (up to {format_number(100 * pressed)} % from the "
        "model's) are those with which the least is outside."
    )
    unknown = sorted({sensor for (sensor, _), item in errors.noise.items() if item.source == "unknown"})
    if unknown:
        yield (
            f"The noise of {', '.join(unknown)} is not known (too few curves to estimate it, and none stated): only "
            "numerical error widens those limits, so state it in the manifest."
        )
    short = sorted({sensor for (sensor, _), item in errors.noise.items() if item.source == "scatter"})
    if short:
        yield (
            f"The curves of {', '.join(short)} have too few frequencies to separate noise from friction history: their "
            "whole scatter counts as noise, and smaller departures from the limits are not detected."
        )
    missing = sum(item.family.n_point - item.n_compared for item in comparison.verdicts)
    if missing:
        yield f"{missing} readings lie where no limit was found, and were not compared."


def _reach(limits: FamilyLimits, unit: str) -> str:
    """Reach of the sliders, in words."""
    if not np.isfinite(limits.reach).all():
        return "anywhere"
    furthest = [f"{1e6 * item:.3g} um" for item in limits.reach.max(axis=1)]
    if len(set(furthest)) == 1:
        return f"at most {furthest[0]} from where they carry no force at rest"
    reaches = [f"{item} at {level:g} {unit}" for item, level in zip(furthest, limits.levels, strict=True)]
    return f"from where they carry no force at rest by at most {_join_items(reaches, bare=True)}"


def _format_calibration(comparison: FamilyComparison, fit: FamilyCalibration) -> Iterator[str]:
    yield (
        "  Calibration onto the families, compared with least squares on the mean of the repeats (factors on the case):"
    )
    yield f"  {'':<10}  {'mean':>8}  {'families':>8}"
    for name, mean, own in zip(fit.names, fit.to_mean.tolist(), fit.to_families.tolist(), strict=True):
        yield f"  {name:<10}  {mean:8.4f}  {own:8.4f}"
    both = (_compute_totals(fit.verdicts_of_mean), _compute_totals(comparison.verdicts))
    for what, show in (("coverage", _format_share), ("tightness", _number), ("score", _number)):
        mean_, own_ = (show(item[what]) for item in both)
        yield f"  {what:<10}  {mean_:>8}  {own_:>8}"
    yield (
        f"  The fit sampled the bands of {fit.n_evaluation} models; coverage, median tightness and sum of scores are "
        "those of the limits of both models, searched for in full."
    )


def _document_calibration(comparison: FamilyComparison) -> dict[str, Any]:
    fit = comparison.calibration
    assert fit is not None
    return {
        "factors_of_mean": dict(zip(fit.names, fit.to_mean.tolist(), strict=True)),
        "factors": dict(zip(fit.names, fit.to_families.tolist(), strict=True)),
        "of_mean": _compute_totals(fit.verdicts_of_mean),
        "of_families": _compute_totals(comparison.verdicts),
        "n_evaluation": fit.n_evaluation,
    }


def _compute_totals(verdicts: Sequence[FamilyVerdict]) -> dict[str, float]:
    """Coverage of all readings, median tightness and sum of scores."""
    compared = [item for item in verdicts if item.n_compared]
    count = sum(item.n_compared for item in compared)
    tight = [item.tightness for item in compared if np.isfinite(item.tightness)]
    return {
        "coverage": sum(item.coverage * item.n_compared for item in compared) / max(count, 1),
        "tightness": float(np.median(tight)) if tight else float("nan"),
        "score": float(sum(item.score for item in compared)),
    }


def _format_share(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{100 * value:.1f} %"


def _number(value: float) -> str:
    if abs(value) < NO_WIDTH:
        return "0"
    return "-" if np.isnan(value) else "inf" if np.isinf(value) else f"{value:.3g}"
