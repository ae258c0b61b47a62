"""Diagnosis of time records: one round, or rounds until no further effect passes the test."""

from collections.abc import Collection, Mapping, Sequence
from typing import TypeAlias, TypedDict, Unpack

from correlation.campaign.time_record import TimeRecord
from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue, Extra, list_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis, ProgressFractions, Report, screen_and_refit
from diagnosis.fit.added import AddedEffect
from diagnosis.step import compute_step
from diagnosis.time_record.arrangement import RecordArrangement, arrange_records, record_level
from diagnosis.time_record.held_out import judge_records

#: Timed on records of some thousand samples.
PROGRESS = ProgressFractions(screening=0.4, fits=0.6, tests=0.9, covariances=1.0, explanation=1.0, intervals=1.0)

RecordDiagnosis: TypeAlias = Diagnosis[RecordArrangement]


class Preparation(TypedDict, total=False):
    """Options for the preparation of records, see `diagnosis.time_record.arrangement.arrange_records`."""

    run_in: float
    noise: Mapping[str, float] | None
    steps: int


class RecordOptions(Preparation, total=False):
    """Options of all rounds, see `diagnose_records`."""

    without: Collection[str]
    extra: Sequence[Extra]
    units: Mapping[str, str] | None
    report: Report | None


def list_next_added(diagnosis: RecordDiagnosis) -> tuple[AddedEffect, ...]:
    """Added effects of the next round: those of this one, and the missing effect that it names."""
    arrangement = diagnosis.arrangement
    if diagnosis.verdict.finding is not Finding.MISSING:
        return arrangement.added
    best = diagnosis.verdict.effects[0]
    assert best.effect is not None
    first = best.fit.unknowns.n_start + sum(len(item.parameters) for item in arrangement.calibration)
    added = []
    for effect in (*(item.effect for item in arrangement.added), best.effect):
        last = first + len(effect.parameters)
        added.append(AddedEffect(effect=effect, values=best.fit.values[first:last]))
        first = last
    return tuple(added)


def diagnose_records(
    base: Model,
    records: Sequence[TimeRecord],
    calibration: Sequence[Effect],
    *,
    added: Sequence[AddedEffect] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    units: Mapping[str, str] | None = None,
    report: Report | None = None,
    **preparation: Unpack[Preparation],
) -> RecordDiagnosis:
    """Identify the effect that is missing from a model: one round.

    Parameters
    ----------
    base
        Model without the added effects; records excite it along its harmonic force of 1 N.
    records
        Training records and held-out records.
    calibration
        Parameters of every fit, without priors.
    added
        Effects added in earlier rounds; they are fitted again with everything else.
    without, extra
        Kinds of effects to leave out, and the user's own effects.
    units
        Names of "N" and "m" in a model that is not in SI, such as {"N": "V", "m": "V"}, for the verdict.
    report
        Called before each step.
    preparation
        `run_in`, `noise` and `steps`, as in `diagnosis.time_record.arrangement.arrange_records`.
    """
    report_step = report or (lambda _what, _share: None)
    report_step("fitting the calibration parameters", 0.0)
    arrangement = arrange_records(base, records, calibration, added=added, **preparation)
    there = {item.effect.name for item in added} | {item.name for item in calibration}
    listed = list_effects(base, without=without, extra=extra, level=record_level(base, records))
    report_step("selection of the effects that the records can show", 0.2)
    effects, left = arrangement.testable([item for item in listed.candidates if item.name not in there])
    scores, baseline, refits = screen_and_refit(arrangement, effects, compute_step, report_step, PROGRESS)
    refits.sort(key=lambda refit: refit.held_out_error)
    return Diagnosis(
        arrangement=arrangement, catalogue=Catalogue(candidates=effects, untestable=(*listed.untestable, *left)),
        scores=tuple(scores), baseline=baseline, refits=tuple(refits),
        verdict=judge_records(baseline, refits, arrangement.held_out.floor, scores, units),
    )  # fmt: skip


def record_rounds(
    base: Model,
    records: Sequence[TimeRecord],
    calibration: Sequence[Effect],
    *,
    most: int = 3,
    **options: Unpack[RecordOptions],
) -> list[RecordDiagnosis]:
    """Add the missing effect and diagnose again, until none passes the test or several cannot be distinguished.

    Parameters
    ----------
    most
        Largest number of rounds [-].
    base, records, calibration, options
        As in `diagnose_records`.
    """
    rounds: list[RecordDiagnosis] = []
    while len(rounds) < most and (not rounds or rounds[-1].verdict.finding is Finding.MISSING):
        added = list_next_added(rounds[-1]) if rounds else ()
        rounds.append(diagnose_records(base, records, calibration, added=added, **options))
    return rounds
