"""Modes of a structure from measured frequency responses: poles, shapes, and their uncertainty."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.modal.modal_model import ModalFit, Powers
from correlation.modal.mode_choice import RESOLUTION, ResponseData, choose_modes
from correlation.modal.stabilisation import Stabilisation, find_poles, select_modes
from correlation.modal.window import Window, compute_pole_response
from correlation.model import DERIVATIVE
from geometry.plain_number import format_number
from geometry.read_only_array import freeze_fields

Numbers = Float[NDArray[np.float64], " m"]

#: Highest order of the diagram, and least number of lines per order [-].
HIGHEST_ORDER, LINES_PER_ORDER = 30, 3
#: Least number of lines for an identification of modes [-].
FEWEST_LINES = 8
#: A mode with fewer lines between its half-power points is not resolved [-].
FEW_LINES = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Modes:
    """Modes of a structure.

    Parameters
    ----------
    frequency, frequency_deviation
        Undamped natural frequencies, ascending, shape (m,) [Hz].
    damping_ratio, damping_deviation
        Damping ratios, shape (m,) [-].
    shapes, shape_deviation
        Shapes, (c, m): residues over the largest one of each mode, so that this sensor is 1 [-]; with a driving point
        normalised to unit modal mass [1/sqrt(kg)]. The deviation is that of the real and of the imaginary part.
    residues
        A_k of H = s^p sum A_k / (s - s_k) + conj., with p the time derivatives of each sensor, shape (c, m) [unit of
        the response times s^(1 - p)].
    participation
        Share of the mean square of all responses due to the mode alone, shape (m,) [-]; the sum over overlapping modes
        is not 1.
    residual
        Root mean square of the residual over that of each response, shape (c,) [-].
    fitted
        Responses of the modes, for comparison with the measured ones, shape (c, f).
    stabilisation
        All poles of the stabilisation diagram.
    leaks
        Whether leakage of a window has changed the responses near a mode.
    suspicions
        Messages on doubts about the result.
    remarks
        Messages on properties that the lines do not determine.
    """

    frequency: Numbers
    frequency_deviation: Numbers
    damping_ratio: Numbers
    damping_deviation: Numbers
    shapes: Complex[NDArray[np.complex128], "c m"]
    shape_deviation: Float[NDArray[np.float64], "c m"]
    residues: Complex[NDArray[np.complex128], "c m"]
    participation: Numbers
    residual: Float[NDArray[np.float64], " c"]
    fitted: Complex[NDArray[np.complex128], "c f"]
    stabilisation: Stabilisation
    leaks: bool = False
    suspicions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(
            self, "frequency", "frequency_deviation", "damping_ratio", "damping_deviation", "shape_deviation",
            "participation", "residual",
        )  # fmt: skip
        freeze_fields(self, "shapes", "residues", "fitted", kind=np.complex128)


def fit_modes(
    frequency: Any,
    responses: Any,
    *,
    quantity: str | Sequence[str] = "acceleration",
    deviation: Any | None = None,
    band: tuple[float, float] | None = None,
    n_mode: int | None = None,
    driving_point: int | None = None,
    decay: float = 0.0,
    window: Window = Window.UNKNOWN,
) -> Modes:
    """Modes in a band of measured frequency responses to one force.

    Parameters
    ----------
    frequency
        Frequencies, ascending, evenly spaced or not, shape (f,) [Hz].
    responses
        Responses of all sensors in the measured quantity, shape (f,) or (c, f) [quantity / N], so that their noise is
        modelled correctly.
    quantity
        "displacement", "velocity" or "acceleration", for all sensors or for each.
    deviation
        Standard deviation of real and imaginary part, shape (c, f); by default equal along each response.
    band
        Lowest and highest frequency to use [Hz].
    n_mode
        Number of modes; by default chosen by an information criterion.
    driving_point
        Row of the sensor at the force, for shapes of unit modal mass.
    decay
        sigma of an exponential window [1/s], whose damping is subtracted.
    window
        Window under which the responses were estimated; its leakage is corrected.

    Raises
    ------
    CampaignError
        Inconsistent shapes, too few lines, an unknown quantity, or no mode in the band.
    """
    lines, values, spread = _check_responses(frequency, responses, deviation, band)
    power = _count_derivatives(quantity, len(values))
    scale = np.sqrt((np.abs(values) ** 2).mean(axis=1, keepdims=True))
    order = int(np.clip(len(lines) // LINES_PER_ORDER, 2, HIGHEST_ORDER))
    diagram = find_poles(lines, values / scale, order)
    data = ResponseData(lines=lines, values=values, spread=spread, power=power)
    data, fit = choose_modes(data, select_modes(diagram), n_mode, window)
    if not len(fit.poles):
        raise CampaignError(
            f"no mode between {lines[0]:.6g} and {lines[-1]:.6g} Hz exceeds the noise: choose another "
            "band, or name "
            "the number of modes (n_mode)"
        )
    return _describe(data, fit, diagram, driving_point, decay)


def _count_derivatives(quantity: str | Sequence[str], n_sensor: int) -> Powers:
    """Time derivatives of the displacement that each sensor measures, shape (c,)."""
    quantities = [quantity] * n_sensor if isinstance(quantity, str) else list(quantity)
    for item in quantities:
        if item not in DERIVATIVE:
            raise CampaignError(f'"{item}" is not a quantity of a frequency response: give {", ".join(DERIVATIVE)}')
    if len(quantities) != n_sensor:
        raise CampaignError(f"{len(quantities)} quantities for {n_sensor} responses: give one, or one for each")
    return np.array([DERIVATIVE[item] for item in quantities], dtype=np.int64)


def _check_responses(
    frequency: Any, responses: Any, deviation: Any | None, band: tuple[float, float] | None
) -> tuple[
    Float[NDArray[np.float64], " f"], Complex[NDArray[np.complex128], "c f"], Complex[NDArray[np.complex128], "c f"] |
    None
]:  # fmt: skip
    """Lines of the band, and responses and deviations at these."""
    lines, values = np.asarray(frequency, dtype=np.float64), np.atleast_2d(np.asarray(responses, dtype=np.complex128))
    if lines.ndim != 1 or values.ndim != 2 or values.shape[1] != len(lines):
        raise CampaignError(
            f"frequencies have shape {lines.shape} and responses {values.shape}: give (f,) and (c, f), a row per sensor"
        )
    used = np.isfinite(values).all(axis=0) & (lines > 0)
    if band is not None:
        used &= (lines >= band[0]) & (lines <= band[1])
    if (np.diff(lines) <= 0).any():
        raise CampaignError(f"frequencies do not rise at line {int(np.argmax(np.diff(lines) <= 0)) + 1}: sort them")
    if used.sum() < FEWEST_LINES:
        raise CampaignError(f"{int(used.sum())} lines are left{_between(lines)}: modes need {FEWEST_LINES} or more")
    silent = np.flatnonzero(~(np.abs(values[:, used]).max(axis=1) > 0))
    if len(silent):
        raise CampaignError(f"the response of sensor {silent[0]} is zero at all lines: leave it out")
    spread = None
    if deviation is not None:
        whole = np.broadcast_to(np.asarray(deviation, dtype=np.float64), values.shape)[:, used]
        least = 1e-9 * np.abs(values[:, used]).max(axis=1, keepdims=True)
        spread = np.where(np.isfinite(whole), np.maximum(whole, least), np.abs(values[:, used]).max()).astype(complex)
    return lines[used], values[:, used], spread


def _between(lines: Float[NDArray[np.float64], " f"]) -> str:
    return f" between {lines[0]:.6g} and {lines[-1]:.6g} Hz" if len(lines) else ""


def _describe(
    data: ResponseData, fit: ModalFit, diagram: Stabilisation, driving_point: int | None, decay: float
) -> Modes:
    """Frequencies, damping and shapes from poles and residues."""
    values = data.values
    order = np.argsort(fit.poles.imag)
    poles, residues = fit.poles[order], fit.residues[:, order]
    m = len(poles)
    places = np.concatenate([order, m + order])
    excess = np.tile(_compute_local_excess(data, fit)[order], 2)
    covariance = fit.pole_covariance[np.ix_(places, places)] * np.sqrt(np.outer(excess, excess))
    poles = poles + decay  # an exponential window shifts all poles to the left
    size = np.abs(poles)
    by_pole = np.hstack([np.diag(poles.real / size), np.diag(poles.imag / size)])
    by_damping = np.hstack([np.diag(-(poles.imag**2) / size**3), np.diag(poles.real * poles.imag / size**3)])
    suspicions = []
    if driving_point is None:
        largest = residues[np.abs(residues).argmax(axis=0), np.arange(m)]
    else:
        # phi_c phi_d / (2 i omega_d) is the residue of a mode of unit modal mass.
        largest = residues[driving_point] / np.sqrt(residues[driving_point] * 2j * poles.imag)
        lag = np.angle(residues[driving_point] * 1j)
        suspicions += [
            f"mode at {size[k] / (2 * np.pi):.6g} Hz: the residue at the driving point has a phase of "
            f"{format_number(np.degrees(lag[k]), 3)} deg relative to that of a structure with proportional damping: "
            "the force acts elsewhere, or has the opposite sign"
            for k in np.flatnonzero(np.abs(lag) > np.pi / 4)
        ]
    if (poles.real >= 0).any():
        suspicions.append(
            f"an exponential window of {decay:.4g} 1/s leaves no damping: its rate is not that of the data"
        )
    s = 2j * np.pi * data.lines[:, None]
    parts = np.array(
        [
            [
                compute_pole_response(s, item, power, data.duration)[0].T
                for item in (fit.poles[order], fit.poles[order].conj())
            ]
            for power in data.power.tolist()
        ]
    )  # by sensor, pole and its conjugate, mode and line
    alone = [residues[:, k, None] * parts[:, 0, k] + residues[:, k, None].conj() * parts[:, 1, k] for k in range(m)]
    total = (np.abs(values) ** 2).sum(axis=1)
    damping_deviation = np.sqrt(np.diag(by_damping @ covariance @ by_damping.T))
    if data.duration is None:  # too few lines to detect leakage
        unresolved = -fit.poles[order].real / np.pi < FEW_LINES * np.diff(data.lines).min()
        damping_deviation = np.where(unresolved, np.maximum(damping_deviation, -poles.real / size), damping_deviation)
    return Modes(
        frequency=size / (2 * np.pi),
        frequency_deviation=np.sqrt(np.diag(by_pole @ covariance @ by_pole.T)) / (2 * np.pi),
        damping_ratio=-poles.real / size,
        damping_deviation=damping_deviation,
        shapes=residues / largest,
        shape_deviation=fit.residue_deviation[:, order] / np.abs(largest),
        residues=residues,
        participation=np.array([((np.abs(part) ** 2).sum(axis=1) / total).mean() for part in alone]),
        residual=np.sqrt((np.abs(values - fit.fitted) ** 2).sum(axis=1) / total),
        fitted=fit.fitted,
        stabilisation=diagram,
        leaks=data.leaks(fit),
        suspicions=tuple(suspicions),
        remarks=tuple(_describe_unresolved(data.lines, fit.poles[order])),
    )


def _compute_local_excess(data: ResponseData, fit: ModalFit) -> Float[NDArray[np.float64], " m"]:
    """Variance of the residual at the lines of each mode over that of the noise, at least 1, shape (m,) [-].

    At a resonance the leakage of noise exceeds noise proportional to the response.
    """
    if data.duration is None:
        return np.ones(len(fit.poles))
    left = (np.abs(data.values - fit.fitted) ** 2 / (2 * fit.noise**2)).mean(axis=0)
    reach = -fit.poles.real / (2 * np.pi) + RESOLUTION / data.duration
    near = np.abs(data.lines[:, None] - fit.poles.imag / (2 * np.pi)) <= reach
    # The mode itself was fitted to these lines.
    count = np.maximum(near.sum(axis=0) - 2, 1)
    return np.asarray(np.maximum((left[:, None] * near).sum(axis=0) / count, 1.0))


def _describe_unresolved(
    lines: Float[NDArray[np.float64], " f"], poles: Complex[NDArray[np.complex128], " m"]
) -> Iterator[str]:
    """Messages on modes that the lines do not resolve."""
    step = float(np.diff(lines).min())
    for pole in poles.tolist():
        count = -pole.real / np.pi / step
        if count < FEW_LINES:
            yield (
                f"the mode at {abs(pole) / (2 * np.pi):.6g} Hz has {format_number(count)} lines of {step:.4g} Hz "
                "within its half-power bandwidth: too few to separate one mode from two; the window determines its "
                "damping: measure longer blocks"
            )
