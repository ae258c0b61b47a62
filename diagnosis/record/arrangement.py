"""Training and held-out records beside a model whose accepted parameters are fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import DERIVATIVE, Model, Sensor
from correlation.record_prediction import STEPS, drive
from diagnosis.effect.candidate import Effect
from diagnosis.effect.scale import scale
from diagnosis.fit.arrangement import Added
from diagnosis.fit.unknowns import Unknowns
from diagnosis.record.comparison import RecordComparison
from diagnosis.record.fit import RecordFit, fit_records


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordArrangement:
    """What a diagnosis of time records works on.

    Parameters
    ----------
    base
        Model without the added effects.
    accepted
        Parameters that are always fitted.
    added
        Effects that were added before.
    train, held
        Records.
    fit
        Of the accepted parameters and the added effects.
    """

    base: Model
    accepted: tuple[Effect, ...]
    added: tuple[Added, ...]
    train: RecordComparison
    held: RecordComparison
    fit: RecordFit

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Accepted parameters, added effects, then others."""
        return Unknowns.of(self.base, (), [*self.accepted, *(each.effect for each in self.added), *effects])


def arrange_records(
    base: Model,
    records: Sequence[TimeRecord],
    accepted: Sequence[Effect],
    *,
    added: Sequence[Added] = (),
    run_in: float = 0.0,
    noise: Mapping[str, float] | None = None,
    steps: int = STEPS,
) -> RecordArrangement:
    """Fit the accepted parameters, and added effects beside them.

    Parameters
    ----------
    base
        Model without the added effects.
    records
        Some of them held out.
    accepted
        Parameters that are always fitted, such as `calibration_parameter.accepted(base)` and the gain of a sensor.
    added
        Effects that were added before.
    run_in
        What is not compared at the beginning of records with a force [s].
    noise
        Standard deviation of the noise of sensors, by name [unit of the record]; none if it is not known.
    steps
        Of the march a sample [-].

    Raises
    ------
    CampaignError
        No record to train on, or none held out.
    """
    drives = [drive(each, run_in=run_in if each.force is not None else 0.0, steps=steps) for each in records]
    given = dict(noise or {})
    known = {name for each in drives for name in each.sensors}
    for name in given:
        if name not in known:
            raise CampaignError(
                f'noise is given for "{name}", which no record has: they have {", ".join(sorted(known))}'
            )
    groups = [[each for each in drives if each.record.held_out is held] for held in (False, True)]
    for group, what in zip(groups, ("held out", "for training"), strict=True):
        if not group:
            raise CampaignError(f"all {len(drives)} records are {what}: a fit is trained on some and tested on others")
    train, held = (RecordComparison.of(group, base, given) for group in groups)
    unknowns = Unknowns.of(base, (), [*accepted, *(each.effect for each in added)])
    n_accepted = sum(len(each.parameters) for each in accepted)
    start = np.concatenate([unknowns.vanishing[:n_accepted], *(each.values for each in added)])
    return RecordArrangement(
        base=base, accepted=tuple(accepted), added=tuple(added), train=train, held=held,
        fit=fit_records(train, unknowns, start),
    )  # fmt: skip


def record_level(base: Model, records: Sequence[TimeRecord]) -> float:
    """Harmonic force at the first resonance that would move the sensors as far as the records show [N, or V].

    Typical strengths of nonlinear effects are reckoned at it.
    """
    size = scale(base)
    resonance = size.resonances[0]
    levels = []
    for record in records:
        for sensor in base.sensors:
            if isinstance(sensor, Sensor) and sensor.name in record.channels:
                read = resonance.amplitude(sensor.row) * resonance.angular_frequency ** DERIVATIVE[sensor.quantity]
                values = record.channel(sensor.name)
                if read:
                    levels.append(float(np.abs(values - values.mean()).max() / (abs(sensor.gain) * read)))
    if not levels:
        raise CampaignError("no record has a channel that a sensor of the model reads and its force moves")
    return max(levels)


def about_mean(record: TimeRecord) -> TimeRecord:
    """The record with the mean of its force taken off: the offset of an amplifier is no force."""
    if record.force is None:
        return record
    values = np.array(record.values)
    number = record.channels.index(record.force)
    values[number] -= values[number].mean()
    return replace(record, values=values)


def stretch(record: TimeRecord, first: int, last: int, *, name: str, held_out: bool) -> TimeRecord:
    """Samples `first` to `last` (not included) of a record as one of their own."""
    if not 0 <= first < last <= len(record.time):
        raise CampaignError(
            f'record "{record.name}" has samples 0 to {len(record.time) - 1}: {first} to {last - 1} are not in it'
        )
    values = record.values[:, first:last]
    return replace(record, name=name, time=record.time[first:last], values=values, held_out=held_out)
