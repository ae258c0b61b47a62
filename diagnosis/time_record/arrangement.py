"""Training and held-out records, and a model whose calibration parameters are fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import DERIVATIVE, Model, Sensor
from correlation.time_record.prediction import STEPS, prepare_drive
from correlation.time_record.propagator import make_propagator
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import measure_scale
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration import Fit, calibrate
from diagnosis.fit.fit_parameter import Unknowns, make_start
from diagnosis.fit.problem import EffectSelection, Refit
from diagnosis.time_record.comparison import RecordComparison
from geometry.errors import InputError
from hbsolve.errors import ModelError

#: Least share of an effect that the fitted parameters cannot absorb, for it to be distinguishable from numerical error.
MIN_SHARE_LEFT = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordArrangement:
    """Records and model of a diagnosis.

    Parameters
    ----------
    base
        Model without the added effects.
    calibration
        Calibration parameters, which every fit sets.
    added
        Effects added in earlier rounds.
    train, held_out
        Training records and held-out records.
    fit
        Fit of the calibration parameters and the added effects.
    """

    base: Model
    calibration: tuple[Effect, ...]
    added: tuple[AddedEffect, ...]
    train: RecordComparison
    held_out: RecordComparison
    fit: Fit

    #: The residual of a record is coloured: the gain of its squared error alone neither justifies nor excludes a fit.
    selection: ClassVar[EffectSelection] = EffectSelection(
        least_change=0.0,
        least_unabsorbed_share=MIN_SHARE_LEFT,
        slopes_at_once=False,
        n_best=4,
        n_shortlisted=4,
        least_gain=0.0,
        n_finalist=4,
        largest_chi2_gap=np.inf,
    )

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Starts of ring-downs, calibration parameters, added effects, then others; without priors."""
        applied = [*self.calibration, *(item.effect for item in self.added), *effects]
        return Unknowns.from_effects(self.base, (), applied, self.train.n_start)

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test on the held-out records; the starts of held-out ring-downs are fitted."""
        held = self.held_out
        try:
            residual = held.predict(fit.model).residual
            if held.n_start:
                starts = Unknowns.from_effects(fit.model, (), (), held.n_start)
                residual = calibrate(held, starts, starts.vanishing).residual[: len(residual)]
        except ModelError:  # the model diverges on records to which it was not fitted
            residual = np.full(len(held.block), np.inf)
        errors = held.errors(residual)
        return Refit(
            effect=effect, fit=fit, held_out_reduced_chi2=float(np.mean(residual**2)),
            error=_compute_rms(self.train.errors(fit.residual)), held_out_error=_compute_rms(errors),
            held_out_errors=errors, held_out_names=tuple(item.record.name for item in held.drives),
            blocks=held.by_block(residual**2),
        )  # fmt: skip

    def testable(self, effects: Sequence[Effect]) -> tuple[tuple[Effect, ...], tuple[Untestable, ...]]:
        """Effects that the time integration allows, and the others with the reason."""
        result, left = [], []
        for effect in effects:
            unknowns = self.unknowns([effect])
            ends = [
                make_start(self.fit.values, effect, strength)
                for strength in (effect.parameters[0].vanishes, effect.parameters[0].typical)
            ]
            try:
                for item in self.train.drives:
                    models = (unknowns.compose(end) for end in ends)
                    before, after = (make_propagator(model, item.sensors, item.record.step) for model in models)
                    before.rate(after, 1.0)
            except InputError as reason:
                left.append(Untestable(name=effect.name, reason=str(reason)))
            else:
                result.append(effect)
        return tuple(result), tuple(left)


def arrange_records(
    base: Model,
    records: Sequence[TimeRecord],
    calibration: Sequence[Effect],
    *,
    added: Sequence[AddedEffect] = (),
    run_in: float = 0.0,
    noise: Mapping[str, float] | None = None,
    steps: int = STEPS,
) -> RecordArrangement:
    """Fit the calibration parameters and the added effects.

    Parameters
    ----------
    base
        Model without the added effects.
    records
        Records, some of them held out.
    calibration
        Parameters of every fit, such as `list_calibration_parameters(base)` and the gain of a sensor.
    added
        Effects added in earlier rounds.
    run_in
        Initial duration of records with a force that is not compared [s].
    noise
        Standard deviation of the noise of sensors, by name [unit of the record]; None if unknown.
    steps
        Integration steps per sample [-].

    Raises
    ------
    CampaignError
        No record to train on, or none held out.
    """
    drives = [prepare_drive(item, run_in=run_in if item.force is not None else 0.0, steps=steps) for item in records]
    given = dict(noise or {})
    known = {name for item in drives for name in item.sensors}
    for name in given:
        if name not in known:
            raise CampaignError(
                f'noise is given for "{name}", which no record has: they have {", ".join(sorted(known))}'
            )
    groups = [[item for item in drives if item.record.held_out is held] for held in (False, True)]
    for group, what in zip(groups, ("held out", "for training"), strict=True):
        if not group:
            raise CampaignError(f"all {len(drives)} records are {what}: a fit is trained on some and tested on others")
    train, held = (RecordComparison.prepare(group, base, given) for group in groups)
    unknowns = Unknowns.from_effects(base, (), [*calibration, *(item.effect for item in added)], train.n_start)
    n_own = train.n_start + sum(len(item.parameters) for item in calibration)
    start = np.concatenate([unknowns.vanishing[:n_own], *(item.values for item in added)])
    try:
        fit = calibrate(train, unknowns, start)
    except ModelError as error:
        values = zip(unknowns.names, start[train.n_start :], strict=True)
        raise CampaignError(
            "the response of the model diverges at the start of the fit, with the values "
            + ", ".join(f"{name} {value:.4g}" for name, value in values)
        ) from error
    return RecordArrangement(
        base=base, calibration=tuple(calibration), added=tuple(added), train=train, held_out=held, fit=fit
    )


def _compute_rms(errors: Float[NDArray[np.float64], " records"]) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def record_level(base: Model, records: Sequence[TimeRecord]) -> float:
    """Harmonic force at the first resonance that produces the amplitudes of the records [N, or V].

    Typical strengths of nonlinear effects are computed for this force.
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
        raise CampaignError("no record has a channel of a sensor of the model that the force moves")
    return max(levels)


def about_mean(record: TimeRecord) -> TimeRecord:
    """Record without the mean of its force, which is the offset of an amplifier."""
    if record.force is None:
        return record
    values = np.array(record.values)
    number = record.channels.index(record.force)
    values[number] -= values[number].mean()
    return replace(record, values=values)


def stretch(record: TimeRecord, first: int, last: int, *, name: str, held_out: bool) -> TimeRecord:
    """Samples `first` to `last` (not included) of a record as a new record."""
    if not 0 <= first < last <= len(record.time):
        raise CampaignError(
            f'record "{record.name}" has samples 0 to {len(record.time) - 1}: {first} to {last - 1} are not in it'
        )
    values = record.values[:, first:last]
    return replace(record, name=name, time=record.time[first:last], values=values, held_out=held_out)
