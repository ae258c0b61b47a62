"""Training and held-out records beside a model whose calibration parameters are fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import DERIVATIVE, Model, Sensor
from correlation.record_prediction import STEPS, prepare_drive
from correlation.record_propagator import make_propagator
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import measure_scale
from diagnosis.fit.arrangement import Added
from diagnosis.fit.calibration import Fit, calibrate
from diagnosis.fit.problem import Effort, Refit
from diagnosis.fit.unknowns import Unknowns
from diagnosis.record.comparison import RecordComparison
from geometry.errors import InputError
from hbsolve.errors import ModelError

#: Share of an effect that must be left by the fitted numbers for it to be told from them: below, it is numerical error.
LEFT = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordArrangement:
    """What a diagnosis of time records works on.

    Parameters
    ----------
    base
        Model without the added effects.
    calibration
        Parameters that are always fitted.
    added
        Effects that were added before.
    train, held_out
        Records.
    fit
        Of the calibration parameters and the added effects.
    """

    base: Model
    calibration: tuple[Effect, ...]
    added: tuple[Added, ...]
    train: RecordComparison
    held_out: RecordComparison
    fit: Fit

    #: What is left of a record is coloured: no gain of its squared error says by itself that it is worth a fit.
    effort: ClassVar[Effort] = Effort(
        unseen=0.0, least_left=LEFT, together=False, best=4, most=4, worthless=0.0, finalists=4, far_behind=np.inf
    )

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Where ring-downs start, calibration parameters, added effects, then others; a record outweighs all priors."""
        applied = [*self.calibration, *(each.effect for each in self.added), *effects]
        return Unknowns.from_effects(self.base, (), applied, self.train.n_start)

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """On the held-out records; ring-downs among them may start where they did."""
        held = self.held_out
        try:
            residual = held.predict(fit.model).residual
            if held.n_start:
                starts = Unknowns.from_effects(fit.model, (), (), held.n_start)
                residual = calibrate(held, starts, starts.vanishing).residual[: len(residual)]
        except ModelError:  # it runs away on what it was not fitted to
            residual = np.full(len(held.block), np.inf)
        errors = held.errors(residual)
        return Refit(
            effect=effect, fit=fit, held_chi2=float(np.mean(residual**2)),
            error=_root_mean_square(self.train.errors(fit.residual)), held_error=_root_mean_square(errors),
            held_errors=errors, held_names=tuple(each.record.name for each in held.drives),
            blocks=held.by_block(residual**2),
        )  # fmt: skip

    def testable(self, effects: Sequence[Effect]) -> tuple[tuple[Effect, ...], tuple[Untestable, ...]]:
        """Effects that a march through time can take, and the others with the reason."""
        found, left = [], []
        for effect in effects:
            unknowns = self.unknowns([effect])
            ends = [
                np.array([*self.fit.values, strength, *(each.vanishes for each in effect.parameters[1:])])
                for strength in (effect.parameters[0].vanishes, effect.parameters[0].typical)
            ]
            try:
                for each in self.train.drives:
                    models = (unknowns.compose(end) for end in ends)
                    before, after = (make_propagator(model, each.sensors, each.record.step) for model in models)
                    before.rate(after, 1.0)
            except InputError as reason:
                left.append(Untestable(name=effect.name, reason=str(reason)))
            else:
                found.append(effect)
        return tuple(found), tuple(left)


def arrange_records(
    base: Model,
    records: Sequence[TimeRecord],
    calibration: Sequence[Effect],
    *,
    added: Sequence[Added] = (),
    run_in: float = 0.0,
    noise: Mapping[str, float] | None = None,
    steps: int = STEPS,
) -> RecordArrangement:
    """Fit the calibration parameters, and added effects beside them.

    Parameters
    ----------
    base
        Model without the added effects.
    records
        Some of them held out.
    calibration
        Parameters that are always fitted, such as `list_calibration_parameters(base)` and the gain of a sensor.
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
    drives = [prepare_drive(each, run_in=run_in if each.force is not None else 0.0, steps=steps) for each in records]
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
    train, held = (RecordComparison.prepare(group, base, given) for group in groups)
    unknowns = Unknowns.from_effects(base, (), [*calibration, *(each.effect for each in added)], train.n_start)
    n_own = train.n_start + sum(len(each.parameters) for each in calibration)
    start = np.concatenate([unknowns.vanishing[:n_own], *(each.values for each in added)])
    try:
        fit = calibrate(train, unknowns, start)
    except ModelError as error:
        values = zip(unknowns.names, start[train.n_start :], strict=True)
        raise CampaignError(
            "the model runs away where the fit starts: its values there are "
            + ", ".join(f"{name} {value:.4g}" for name, value in values)
        ) from error
    return RecordArrangement(
        base=base, calibration=tuple(calibration), added=tuple(added), train=train, held_out=held, fit=fit
    )


def _root_mean_square(errors: Float[NDArray[np.float64], " records"]) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def record_level(base: Model, records: Sequence[TimeRecord]) -> float:
    """Harmonic force at the first resonance that would move the sensors as far as the records show [N, or V].

    Typical strengths of nonlinear effects are reckoned at it.
    """
    size = measure_scale(base)
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
