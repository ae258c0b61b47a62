"""One round of diagnosis on time records, or one after another until nothing more passes the gate."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from correlation.campaign.time_record import TimeRecord
from correlation.model import Model
from correlation.record_prediction import STEPS
from diagnosis.decision.verdict import Finding
from diagnosis.effect.candidate import Effect
from diagnosis.effect.catalogue import Catalogue, Extra, catalogue
from diagnosis.fit.arrangement import Added
from diagnosis.record.arrangement import RecordArrangement, arrange_records, record_level
from diagnosis.record.refit import RecordRefit, refit_records, unchanged_records
from diagnosis.record.screening import RecordScore, screen_records, testable
from diagnosis.record.verdict import RecordVerdict, judge_records

#: What is being done, and the share of the round that is done [-].
Report = Callable[[str, float], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordDiagnosis:
    """What one round found.

    Parameters
    ----------
    arrangement
        Records, and the accepted parameters (and added effects) fitted.
    catalogue
        Candidates, and what cannot be tested.
    scores
        Of all candidates, best first.
    before
        The model as it is, fitted and tested on the held-out records.
    refits
        The shortlist fitted in earnest, best first.
    verdict
        In words, with numbers.
    """

    arrangement: RecordArrangement
    catalogue: Catalogue
    scores: tuple[RecordScore, ...]
    before: RecordRefit
    refits: tuple[RecordRefit, ...]
    verdict: RecordVerdict

    @property
    def added(self) -> tuple[Added, ...]:
        """Effects for the next round: those that were there, and the one that was found."""
        if self.verdict.finding is not Finding.MISSING:
            return self.arrangement.added
        best = self.verdict.effects[0]
        assert best.effect is not None
        first, found = sum(len(each.parameters) for each in self.arrangement.accepted), []
        for effect in (*(each.effect for each in self.arrangement.added), best.effect):
            last = first + len(effect.parameters)
            found.append(Added(effect=effect, values=best.fit.values[first:last]))
            first = last
        return tuple(found)


def diagnose_records(
    base: Model,
    records: Sequence[TimeRecord],
    accepted: Sequence[Effect],
    *,
    added: Sequence[Added] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    run_in: float = 0.0,
    noise: Mapping[str, float] | None = None,
    steps: int = STEPS,
    units: Mapping[str, str] | None = None,
    report: Report | None = None,
) -> RecordDiagnosis:
    """Say what is missing.

    Parameters
    ----------
    base
        Model without the added effects; records drive it along its harmonic force of 1 N.
    records
        Those to train on, and those held out.
    accepted
        Parameters that are always fitted, without priors.
    added
        Effects that were added before; they are fitted again with everything else.
    without, extra
        Kinds to leave out, and effects of one's own.
    run_in, noise, steps
        As in `diagnosis.record.arrangement.arrange_records`.
    units
        What "N" and "m" are in a model that is not in SI, such as {"N": "V", "m": "V"}; for the verdict's words.
    report
        Called before each step.
    """

    def tell(what: str, share: float) -> None:
        if report is not None:
            report(what, share)

    tell("fitting the accepted parameters", 0.0)
    arrangement = arrange_records(base, records, accepted, added=added, run_in=run_in, noise=noise, steps=steps)
    before = unchanged_records(arrangement)
    there = {each.effect.name for each in added} | {each.name for each in accepted}
    listed = catalogue(base, without=without, extra=extra, level=record_level(base, records))
    tell("looking which effects the records can show", 0.2)
    effects, left = testable(arrangement, [each for each in listed.candidates if each.name not in there])
    tell("screening", 0.4)
    scores = screen_records(arrangement, effects, lambda done, of: tell("screening", 0.4 + 0.2 * done / of))
    tell("fitting the shortlist", 0.6)
    refits = refit_records(arrangement, scores)
    names = [each.record.name for each in arrangement.held.drives]
    return RecordDiagnosis(
        arrangement=arrangement, catalogue=Catalogue(candidates=effects, untestable=(*listed.untestable, *left)),
        scores=tuple(scores), before=before, refits=tuple(refits),
        verdict=judge_records(before, refits, arrangement.held.floor, names, scores, units),
    )  # fmt: skip


def record_rounds(
    base: Model,
    records: Sequence[TimeRecord],
    accepted: Sequence[Effect],
    *,
    most: int = 3,
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    run_in: float = 0.0,
    noise: Mapping[str, float] | None = None,
    steps: int = STEPS,
    units: Mapping[str, str] | None = None,
    report: Report | None = None,
) -> list[RecordDiagnosis]:
    """Add what is found and look again, until nothing more passes the gate or two effects cannot be told apart.

    Parameters
    ----------
    most
        Rounds at most.
    base, records, accepted, without, extra, run_in, noise, steps, units, report
        As in `diagnose_records`.
    """
    rounds: list[RecordDiagnosis] = []
    while len(rounds) < most and (not rounds or rounds[-1].verdict.finding is Finding.MISSING):
        rounds.append(
            diagnose_records(
                base, records, accepted, added=rounds[-1].added if rounds else (), without=without, extra=extra,
                run_in=run_in, noise=noise, steps=steps, units=units, report=report,
            )
        )  # fmt: skip
    return rounds
