"""Response of a model to the force of a time record, sample by sample, and its derivatives with parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.time_record.propagator import SHARED, Propagator, make_propagator

Samples = Float[NDArray[np.float64], "s n"]
State = Float[NDArray[np.float64], " n"]

#: Integration steps per sample.
STEPS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class IntegrationInput:
    """Input of the integration: the force of a record, and the samples to compare.

    Parameters
    ----------
    record
        The record.
    sensors
        Channels that are compared.
    force
        Force at all instants of the integration, zeros for a ring-down, shape ((n - 1) steps + 1,) [N, or V].
    steps
        Integration steps per sample [-].
    first
        First sample that is compared: those before settle from rest [-].
    """

    record: TimeRecord
    sensors: tuple[str, ...]
    force: Float[NDArray[np.float64], " t"]
    steps: int
    first: int

    @property
    def measured(self) -> Samples:
        """Measured values of the compared samples, shape (s, n)."""
        return np.stack([self.record.channel(name)[self.first :] for name in self.sensors])


def prepare_drive(
    record: TimeRecord, *, run_in: float = 0.0, sensors: Sequence[str] | None = None, steps: int = STEPS
) -> IntegrationInput:
    """Prepare a record.

    Parameters
    ----------
    record
        Record with a uniform step.
    run_in
        Duration at its beginning that is not compared, since the model starts from rest: a few decay times [s].
    sensors
        Channels to compare; all but the force by default.
    steps
        Integration steps per sample [-].

    Raises
    ------
    CampaignError
        Steps that vary, a run-in that leaves nothing, or no sensor.
    """
    names = tuple(sensors if sensors is not None else (item for item in record.channels if item != record.force))
    if not names:
        raise CampaignError(f'record "{record.name}" has no channel but the force: add what a sensor read')
    for name in names:
        record.channel(name)
    first = round(run_in / record.step)
    if not 0 <= first < len(record.time) - 1:
        raise CampaignError(
            f'record "{record.name}" lasts {record.time[-1] - record.time[0]:.4g} s: a run-in of {run_in:.4g} s leaves '
            "nothing to compare"
        )
    if steps < 1:
        raise CampaignError(f"{steps} steps per sample: give 1 or more")
    if record.force is None:
        force = np.zeros((len(record.time) - 1) * steps + 1)
    else:
        force = compensate_interpolation(refine(record.channel(record.force), steps))
    return IntegrationInput(record=record, sensors=names, force=force, steps=steps, first=first)


def predict_record(model: Model, driven: IntegrationInput, start: State | None = None) -> Samples | None:
    """Predicted sensor readings, shape (s, n); None where the response diverges.

    Parameters
    ----------
    model
        Model with springs, stops and dampers as joints.
    driven
        The record.
    start
        Displacements and velocities at its first sample, shape (2 r,); rest by default.
    """
    matrices = _make_record_propagator(model, driven)
    begin = np.zeros(len(matrices.phi)) if start is None else start
    value = _integrate(driven, [matrices], begin[None])
    return None if value is None else value[0]


def predict_rates(
    model: Model,
    driven: IntegrationInput,
    pairs: Sequence[tuple[Model, Model, float]],
    start: State | None = None,
    basis: Float[NDArray[np.float64], "b n"] | None = None,
) -> Float[NDArray[np.float64], "p s n"]:
    """Rates of the sensors' values, shape (p + b, s, n); the model itself must be predictable.

    Parameters
    ----------
    model, driven, start
        As in `predict_record`.
    pairs
        A parameter each: the model a little below, a little above, and by how much it differs.
    basis
        Changes of the start for further derivatives, after those of the parameters, shape (b, 2 r).

    Raises
    ------
    ArithmeticError
        The response diverges.
    """
    matrices = _make_record_propagator(model, driven)
    rates = [
        _make_record_propagator(low, driven).rate(_make_record_propagator(high, driven), step)
        for low, high, step in pairs
    ]
    n = len(matrices.phi)
    begin = np.zeros((1 + len(pairs), n))
    if start is not None:
        begin[0] = start
    if basis is not None:
        nothing = matrices.rate(matrices, 1.0)
        rates += [nothing] * len(basis)
        begin = np.vstack([begin, basis])
    value = _integrate(driven, [matrices, *rates], begin)
    if value is None:
        raise ArithmeticError(f'the response of the model diverges in record "{driven.record.name}"')
    return value[1:]


def estimate_numerical_error(model: Model, driven: IntegrationInput) -> float:
    """Difference to steps half as long, relative to the response, all sensors together [-].

    The integration is of second order in the forces of joints, of fourth in that of the record: the error is at most
    4/3 of this.
    """
    coarse = predict_record(model, driven)
    finer = prepare_drive(driven.record, sensors=driven.sensors, steps=2 * driven.steps)
    fine = predict_record(model, replace(finer, first=driven.first))
    if coarse is None or fine is None:
        return np.inf
    return float(np.linalg.norm(fine - coarse) / np.linalg.norm(fine))


def _make_record_propagator(model: Model, driven: IntegrationInput) -> Propagator:
    return make_propagator(model, driven.sensors, driven.record.step / driven.steps)


def _integrate(
    driven: IntegrationInput, matrices: Sequence[Propagator], start: Float[NDArray[np.float64], "p1 n"]
) -> Float[NDArray[np.float64], "p1 s n"] | None:
    from correlation.time_record.integration import integrate

    stacked: dict[str, Any] = {
        name: np.ascontiguousarray([getattr(item, name) for item in matrices], dtype=np.float64)
        for name in Propagator._fields
        if name not in SHARED
    }
    value = np.zeros((len(matrices), len(driven.sensors), len(driven.record.time)))
    begin = np.ascontiguousarray(start, dtype=np.float64)
    done = integrate(matrices[0]._replace(**stacked), begin, driven.force, driven.steps, value)
    return value[:, :, driven.first :] if done else None


#: Samples on either side that the interpolating kernel reaches, and the parameter of its Kaiser window: amplitudes up
#: to 0.9 of half the sampling rate are right to 1e-4.
REACH, WINDOW = 40, 8.0


def refine(values: Float[NDArray[np.float64], " n"], factor: int) -> Float[NDArray[np.float64], " t"]:
    """Band-limited values at `factor` times the rate, from the first sample to the last; the samples themselves stay.

    Parameters
    ----------
    values
        Shape (n,); before its start and behind its end the first and last are taken to stay, which costs accuracy
        within `REACH` samples of there.
    factor
        Whole number [-].
    """
    from scipy.signal import upfirdn

    place = np.arange(-REACH * factor, REACH * factor + 1) / factor
    kernel = np.sinc(place) * np.kaiser(len(place), WINDOW)
    padded = np.concatenate([np.full(REACH, values[0]), values, np.full(REACH, values[-1])])
    fine = upfirdn(kernel, padded - values[0], factor) + values[0]
    start = 2 * REACH * factor
    return np.array(fine[start : start + (len(values) - 1) * factor + 1], dtype=np.float64)


def compensate_interpolation(fine: Float[NDArray[np.float64], " t"]) -> Float[NDArray[np.float64], " t"]:
    r"""Compensate linear interpolation: values whose interpolant acts like a smooth curve through `fine`, shape (t,).

    Lines through a sine of :math:`\omega h` an instant have :math:`1 - (\omega h)^2 / 12` of its amplitude; the second
    difference puts that back, and leaves an error of fourth order.
    """
    corrected = np.array(fine, dtype=np.float64)
    corrected[1:-1] -= np.diff(fine, 2) / 12
    return corrected
