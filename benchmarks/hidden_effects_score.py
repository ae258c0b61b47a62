"""Score of the hidden-effect test: fractions with confidence intervals, and the confusion matrix."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden_effects_confusion import Confusion, confusion
from benchmarks.hidden_effects_groups import Groups
from benchmarks.hidden_effects_plan import EXCLUDED, PLANTED
from benchmarks.hidden_effects_record import AMBIGUOUS, FAILED, MISSING, UNKNOWN, Fitted, Record, of_rows
from transient.virtual_bench.effect import NOTHING

#: Standard normal quantile of an interval of 95 %.
QUANTILE = 1.959964
#: Largest relative error of a correct strength, and largest predicted relative deviation of a strength that is scored.
STRENGTH_ERROR, SHARP = 0.15, 0.05
POOLED = "pooled"


@dataclass(frozen=True, kw_only=True)
class Share:
    """Fraction `count` of `of`."""

    count: int
    of: int

    @property
    def value(self) -> float:
        """Fraction [-]; NaN if `of` is 0."""
        return self.count / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Confidence interval of 95 % [-]."""
        return wilson(self.count, self.of)


def wilson(count: int, of: int) -> tuple[float, float]:
    """Confidence interval of 95 % of a proportion; 0 to 1 if `of` is 0.

    References
    ----------
    E. B. Wilson, Probable inference, the law of succession, and statistical inference, Journal of the American
    Statistical Association 22 (1927) 209-212.
    """
    if not of:
        return 0.0, 1.0
    share, z2 = count / of, QUANTILE**2
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = QUANTILE / (1 + z2 / of) * math.sqrt(share * (1 - share) / of + z2 / (4 * of**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True, kw_only=True)
class Floor:
    """Held-out error of the true model, estimated from campaigns without a planted effect.

    Parameters
    ----------
    factor
        Median ratio of the held-out error to the error expected from the covariance [-]. Fits and the set-up of the
        held-out repeats absorb a part of the expected error.
    chi2
        Mean of the held-out reduced chi-squared [-].
    """

    factor: float
    chi2: float


@dataclass(frozen=True, kw_only=True)
class Excess:
    """Ratio of the held-out error above the floor with the named effect to that without it.

    Parameters
    ----------
    of, seen
        Number of campaigns, and number of those whose error without the effect exceeds the floor.
    halved
        Number of the latter whose excess is at most halved by the effect.
    median
        Median ratio of the latter [-].
    together
        Ratio of the means over all campaigns [-].
    weighed
        The same ratio of the reduced chi-squared, which weights each number by noise and friction histories [-].
    """

    of: int
    seen: int
    halved: int
    median: float
    together: float
    weighed: float


@dataclass(frozen=True, kw_only=True)
class RowScore:
    """Score of one kind of planted effect, or of all kinds.

    Parameters
    ----------
    first, itself
        Campaigns whose first effect is the planted one or one of its group; the planted one itself, among effects
        without a group.
    named, wrong
        Verdicts that name the planted effect, alone or among several; verdicts that name only effects outside its
        group.
    strength
        Strengths within 15 % of the true one, where the planted effect is first with a predicted deviation of at most
        5 %.
    covered
        True strengths within the reported interval of 95 %, where the planted effect is first.
    excess
        Held-out error above the floor.
    """

    first: Share
    itself: Share
    named: Share
    wrong: Share
    strength: Share
    covered: Share
    excess: Excess


@dataclass(frozen=True, kw_only=True)
class ExcludedScore:
    """Score of effects missing from the catalogue: verdict "unknown", correct place, both, median force exponent."""

    unknown: Share
    place: Share
    both: Share
    exponent: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Score:
    """Score of all records.

    Processor times are the median and the quantile of 95 % [s].
    """

    planted: dict[str, RowScore]
    claims: Share
    excluded: dict[str, ExcludedScore]
    confusion: Confusion
    seconds: tuple[float, float]
    make_seconds: tuple[float, float]
    floor_factor: float
    failed: int
    code: tuple[str, ...]


def score(records: Sequence[Record], groups: Groups) -> Score:
    """Score records.

    Parameters
    ----------
    records
        One record of each campaign.
    groups
        Effects that cannot be separated.
    """
    nothing = of_rows(records, [NOTHING])
    factor = _median(record.held_error / record.floor for record in nothing if record.floor > 0)
    floor = Floor(
        factor=factor if math.isfinite(factor) else 1.0,
        chi2=float(np.mean([record.held_chi2 for record in nothing])) if nothing else math.nan,
    )
    planted = {row: row_score(of_rows(records, [row]), groups, floor) for row in PLANTED}
    planted[POOLED] = row_score(of_rows(records, PLANTED), groups, floor)
    excluded = {row: excluded_score(of_rows(records, [row])) for row in EXCLUDED}
    excluded[POOLED] = excluded_score(of_rows(records, EXCLUDED))
    cost = [record.make_seconds + record.diagnose_seconds for record in records]
    return Score(
        planted=planted,
        claims=_share(nothing, lambda record: record.finding in (MISSING, AMBIGUOUS, UNKNOWN)),
        excluded=excluded,
        confusion=confusion(records, groups),
        seconds=_quantiles(cost),
        make_seconds=_quantiles([record.make_seconds for record in records]),
        floor_factor=factor,
        failed=sum(record.finding == FAILED for record in records),
        code=tuple(sorted({record.code for record in records if record.code})),
    )


def row_score(records: Sequence[Record], groups: Groups, floor: Floor) -> RowScore:
    """Score campaigns with a planted effect of the catalogue."""
    alone = [record for record in records if not groups.of(record.planted.effect)]
    result = [record for record in records if _first(record) == record.planted.effect]
    sharp = [record for record in result if _spread(record.ranking[0]) <= SHARP]
    return RowScore(
        first=_share(records, lambda record: _right(record, groups)),
        itself=_share(alone, lambda record: _first(record) == record.planted.effect),
        named=_share(records, lambda record: record.planted.effect in record.names),
        wrong=_share(records, lambda record: bool(record.named) and not _named_right(record, groups)),
        strength=_share(sharp, lambda record: abs(_strength_error(record)) <= STRENGTH_ERROR),
        covered=_share(result, _covered),
        excess=excess(records, floor),
    )


def excluded_score(records: Sequence[Record]) -> ExcludedScore:
    """Score campaigns with an effect that the catalogue lacks."""
    return ExcludedScore(
        unknown=_share(records, lambda record: record.finding == UNKNOWN),
        place=_share(records, _placed),
        both=_share(records, lambda record: record.finding == UNKNOWN and _placed(record)),
        exponent=_median(record.place.exponent for record in records if record.place is not None),
    )


def excess(records: Iterable[Record], floor: Floor) -> Excess:
    """Held-out error above the floor with the first named effect; without a named effect it is unchanged."""
    known = [record for record in records if record.finding != FAILED and math.isfinite(record.floor)]
    before = [record.held_error - floor.factor * record.floor for record in known]
    after = [_held_after(record).held_error - floor.factor * record.floor for record in known]
    ratios = [max(late, 0.0) / early for early, late in zip(before, after, strict=True) if early > 0]
    chi2_before = [record.held_chi2 - floor.chi2 for record in known]
    chi2_after = [_held_after(record).held_chi2 - floor.chi2 for record in known]
    return Excess(
        of=len(known),
        seen=len(ratios),
        halved=sum(ratio <= 0.5 for ratio in ratios),
        median=_median(ratios),
        together=_ratio(after, before),
        weighed=_ratio(chi2_after, chi2_before),
    )


def _first(record: Record) -> str | None:
    return record.ranking[0].effect if record.ranking else None


def _right(record: Record, groups: Groups) -> bool:
    return _first(record) in {record.planted.effect, *groups.of(record.planted.effect)}


def _named_right(record: Record, groups: Groups) -> bool:
    return not {record.planted.effect, *groups.of(record.planted.effect)}.isdisjoint(record.names)


def _placed(record: Record) -> bool:
    return record.place is not None and record.place.name == record.planted.place


def _spread(fitted: Fitted) -> float:
    """Predicted relative deviation of a strength [-]."""
    size = abs(fitted.strength - fitted.vanishes)
    return fitted.deviation / size if size else math.inf


def _strength_error(record: Record) -> float:
    """Relative error of the strength, counted from the vanishing strength [-]."""
    result, true = record.ranking[0], record.planted.value
    return (result.strength - true) / (true - result.vanishes)


def _covered(record: Record) -> bool:
    result = record.ranking[0]
    return abs(result.strength - record.planted.value) <= QUANTILE * result.deviation


def _held_after(record: Record) -> Fitted | Record:
    return record.named[0] if record.named else record


def _ratio(after: Sequence[float], before: Sequence[float]) -> float:
    """Ratio of the sums; NaN unless the sum before is positive."""
    return sum(after) / sum(before) if sum(before) > 0 else math.nan


def _share(records: Sequence[Record], holds: Callable[[Record], bool]) -> Share:
    return Share(count=sum(holds(record) for record in records), of=len(records))


def _median(values: Iterable[float]) -> float:
    listed = [value for value in values if math.isfinite(value)]
    return float(np.median(listed)) if listed else math.nan


def _quantiles(values: Iterable[float]) -> tuple[float, float]:
    """Median and quantile of 95 %."""
    listed = [value for value in values if math.isfinite(value)]
    return (float(np.median(listed)), float(np.quantile(listed, 0.95))) if listed else (math.nan, math.nan)
