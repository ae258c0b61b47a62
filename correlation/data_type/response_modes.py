"""Identification of modes from measured frequency responses."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import MeasuredSensor
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import MeasuredMode
from correlation.data_type.registry import Analyse, analyse_uncached
from correlation.errors import CampaignError
from correlation.modal.fit_modes import FEWEST_LINES, Modes, fit_modes
from correlation.modal.window import Window
from correlation.model import DERIVATIVE

#: Median relative residual above which the modes do not explain the responses [-].
UNEXPLAINED = 0.5
#: Relative standard deviation of the frequency from which a mode is discarded [-].
VAGUE = 0.01
#: Smallest standard deviations, relative [-]: the repeatability of a test on a bench, whatever its noise.
LEAST_FREQUENCY, LEAST_DAMPING = 2e-4, 0.03


def read_modes(
    response: MeasuredResponse, sensors: Sequence[MeasuredSensor], analyse: Analyse = analyse_uncached
) -> MeasuredResponse:
    """Add the modes to responses; if no mode can be identified, add a suspicion.

    Parameters
    ----------
    response
        Measured responses.
    sensors
        Sensors of its rows.
    analyse
        As in `DataContext`: the fit takes minutes for responses with thousands of lines.
    """
    coherent, there = response.coherent_lines, np.isfinite(response.value).all(axis=0)
    incoherent, suspicions = int((there & ~coherent).sum()), response.suspicions
    low = f"no sensor has a coherence of {response.coherence_limit:.2g} at {incoherent} of {there.sum()} lines"
    if coherent.sum() < FEWEST_LINES <= there.sum():
        return replace(response, suspicions=(*suspicions, f"no mode was read: {low}: was the force too small there?"))
    if 2 * incoherent > there.sum():
        suspicions += (f"{low}, which are left out of the fit of modes: was the force too small there?",)
    quantity = tuple(sensor.quantity for sensor in sensors)
    result, doubt = analyse(
        fit_or_doubt,
        response.frequency[coherent],
        response.value[:, coherent],
        quantity,
        response.decay,
        response.window,
    )
    suspicions += (doubt,) if doubt else ()
    if result is None:
        return replace(response, suspicions=suspicions)
    # A shape needs two sensors, both calibrated.
    has_shape = len(sensors) > 1 and all(sensor.calibrated for sensor in sensors)
    modes = []
    # A damping ratio that is not positive after the correction of an exponential window is reported as a suspicion.
    for number in np.flatnonzero((result.frequency_deviation < VAGUE * result.frequency) & (result.damping_ratio > 0)):
        omega = 2j * np.pi * result.frequency[number]
        turned = [omega ** DERIVATIVE[sensor.quantity] for sensor in sensors]
        modes.append(
            MeasuredMode(
                name=f"{response.name}, mode {number + 1}",
                configuration=response.configuration,
                frequency=float(result.frequency[number]),
                frequency_deviation=float(
                    np.hypot(result.frequency_deviation[number], LEAST_FREQUENCY * result.frequency[number])
                ),
                damping=float(result.damping_ratio[number]),
                damping_deviation=float(
                    np.hypot(result.damping_deviation[number], LEAST_DAMPING * result.damping_ratio[number])
                ),
                sensors=response.sensors if has_shape else (),
                shape=np.array(result.shapes[:, number] * turned if has_shape else [], dtype=np.complex128),
            )
        )
    return replace(
        response,
        modes=tuple(modes),
        fit=result,
        suspicions=(*suspicions, *result.suspicions),
        remarks=(*response.remarks, *result.remarks),
    )


def fit_or_doubt(
    frequency: Float[NDArray[np.float64], " f"],
    value: Complex[NDArray[np.complex128], "c f"],
    quantity: tuple[str, ...],
    decay: float,
    window: Window,
) -> tuple[Modes | None, str]:
    """Modes of responses, and a doubt about them in words; empty if there is none.

    Parameters
    ----------
    frequency, value, quantity, decay, window
        As in `fit_modes`, shape (f,) and (c, f).
    """
    try:
        result = fit_modes(frequency, value, quantity=quantity, decay=decay, window=window)
    except CampaignError as error:
        why = _fits_conjugate(frequency, value, quantity, decay, window) or str(error)
        return None, f"no mode was read: {why}"
    unexplained = float(np.median(result.residual)) > UNEXPLAINED
    return result, _fits_conjugate(frequency, value, quantity, decay, window) if unexplained else ""


def _fits_conjugate(
    frequency: Float[NDArray[np.float64], " f"],
    value: Complex[NDArray[np.complex128], "c f"],
    quantity: tuple[str, ...],
    decay: float,
    window: Window,
) -> str:
    """Evidence that responses have the opposite time convention, since modes fit their conjugates; else empty."""
    try:
        result = fit_modes(frequency, value.conj(), quantity=quantity, decay=decay, window=window)
    except CampaignError:
        return ""
    if float(np.median(result.residual)) > UNEXPLAINED:
        return ""
    listed = ", ".join(f"{frequency:.4g}" for frequency in result.frequency[:4])
    return (
        f"with the opposite sign of the imaginary parts, {len(result.frequency)} modes at {listed} Hz fit with a "
        f"residual of {np.median(result.residual):.0%}; as stated, none fits: do the numbers have the other time "
        "convention? If so, change convention.time of the manifest"
    )
