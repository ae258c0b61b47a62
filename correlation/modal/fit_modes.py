"""Modes of a structure from its measured frequency responses: poles, shapes, and how well they are known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.modal.assurance import modal_assurance
from correlation.modal.modal_model import ModalFit, Powers, fit_poles
from correlation.modal.stabilisation import MOST_DAMPING, Stabilisation, find_poles, select_modes
from correlation.modal.window import Window, pole_response
from correlation.model import DERIVATIVE
from geometry.plain_number import plain
from geometry.read_only_array import freeze_fields

Numbers = Float[NDArray[np.float64], " m"]

#: Highest order of the diagram, and lines per order at least [-].
HIGHEST_ORDER, LINES_PER_ORDER = 30, 3
#: Lines that modes need at least [-].
FEWEST_LINES = 8
#: A mode stays if it improves the information criterion by more than chance does.
SIGNIFICANT = 10.0
#: Most modes that are added because the residual has a peak.
MOST_ADDED = 4
#: A mode is at least so wide between its half-power points, in distances of lines: a narrower one is a single line.
RESOLVED = 0.1
#: Two modes have one shape from this MAC on [-].
ALIKE = 0.9
#: A mode that has fewer lines between its half-power points is not resolved [-].
FEW_LINES = 1.0
#: Lines are multiples of their distance to this share of it [-].
UNEVEN = 1e-2
#: Modes that are wider than so many lines do not show leakage: it changes their width by less than 1 %. Hann's main
#: lobe is twice so many lines wide: lines of a spectrum that are nearer to each other make one peak [-].
WIDE, RESOLUTION = 20.0, 2.0
#: Damping of a mode that is added is at least so many of its standard deviations: noise has peaks of any width.
CLEAR = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Modes:
    """Modes of a structure.

    Parameters
    ----------
    frequency, frequency_deviation
        Undamped, rising, shape (m,) [Hz].
    damping_ratio, damping_deviation
        Shape (m,) [-].
    shapes, shape_deviation
        Shape (c, m): residues over the largest of each mode, so that this sensor is 1 [-]; with a driving point
        normalised to unit modal mass [1/sqrt(kg)]. The deviation is that of real and imaginary part alike.
    participation
        Share of the mean square of all responses that the mode alone makes up, shape (m,) [-]; overlapping modes do not
        sum to 1.
    residual
        Root mean square of what the modes leave over that of each response, shape (c,) [-].
    fitted
        Responses of the modes as those that were measured, shape (c, f).
    stabilisation
        All poles that were looked at.
    suspicions
        What speaks against the result, in words.
    remarks
        What the lines leave open, in words.
    """

    frequency: Numbers
    frequency_deviation: Numbers
    damping_ratio: Numbers
    damping_deviation: Numbers
    shapes: Complex[NDArray[np.complex128], "c m"]
    shape_deviation: Float[NDArray[np.float64], "c m"]
    participation: Numbers
    residual: Float[NDArray[np.float64], " c"]
    fitted: Complex[NDArray[np.complex128], "c f"]
    stabilisation: Stabilisation
    suspicions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(
            self, "frequency", "frequency_deviation", "damping_ratio", "damping_deviation", "shape_deviation",
            "participation", "residual",
        )  # fmt: skip
        freeze_fields(self, "shapes", "fitted", kind=np.complex128)


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
        Rising, evenly spaced or not, shape (f,) [Hz].
    responses
        Of all sensors as they were measured, shape (f,) or (c, f) [quantity / N]: their noise is then known best.
    quantity
        "displacement", "velocity" or "acceleration", of all sensors or of each.
    deviation
        Standard deviation of real and imaginary part, shape (c, f); by default equal along each response.
    band
        Lowest and highest frequency that are used [Hz].
    n_mode
        Number of modes; by default as many as the data call for.
    driving_point
        Row of the sensor at the force, for shapes of unit modal mass.
    decay
        sigma of an exponential window [1/s], whose damping is taken off.
    window
        Window under which the responses were estimated: its leakage is taken off.

    Raises
    ------
    CampaignError
        Shapes that do not fit, too few lines, an unknown quantity, or no mode in the band.
    """
    lines, values, spread = _checked(frequency, responses, deviation, band)
    power = _count_derivatives(quantity, len(values))
    scale = np.sqrt((np.abs(values) ** 2).mean(axis=1, keepdims=True))
    order = int(np.clip(len(lines) // LINES_PER_ORDER, 2, HIGHEST_ORDER))
    diagram = find_poles(lines, values / scale, order)
    data = _Data(lines=lines, values=values, spread=spread, power=power)
    data, fit = _choose_window(data, select_modes(diagram), n_mode, window)
    if not len(fit.poles):
        raise CampaignError(
            f"no mode between {lines[0]:.6g} and {lines[-1]:.6g} Hz stands out of the noise: choose another "
            "band, or name "
            "the number of modes (n_mode)"
        )
    return _describe(data, fit, diagram, driving_point, decay)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Data:
    """Responses of a band, and what the fit knows of them.

    Parameters
    ----------
    lines, values, spread
        As in `fit_poles`, shape (f,), (c, f) and (c, f).
    power
        Time derivatives of the displacement that each sensor measures, shape (c,).
    duration
        Of Hann's window [s]; None for no leakage.
    """

    lines: Float[NDArray[np.float64], " f"]
    values: Complex[NDArray[np.complex128], "c f"]
    spread: Complex[NDArray[np.complex128], "c f"] | None
    power: Powers
    duration: float | None = None

    def fit(self, poles: Complex[NDArray[np.complex128], " m"]) -> ModalFit:
        """Poles and residues from first guesses of the poles."""
        return fit_poles(self.lines, self.values, poles, self.power, self.spread, self.duration)


def _choose_window(
    data: _Data, poles: Complex[NDArray[np.complex128], " m"], n_mode: int | None, window: Window
) -> tuple[_Data, ModalFit]:
    """The modes under the window that is named, or under the one that explains the responses better."""
    duration = _hann_duration(data.lines)
    leaking = replace(data, duration=duration)
    if window is Window.HANN and duration is not None:
        return leaking, _choose(leaking, _apart(poles, duration), n_mode)
    fit = _choose(data, poles, n_mode)
    if window is not Window.UNKNOWN or duration is None or not _is_narrow(fit, duration):
        return data, fit
    # Leakage makes pairs of modes: with it one mode explains the responses better than one does without it.
    other, single = _choose(leaking, _apart(poles, duration), n_mode), fit
    while n_mode is None and (pair := _unresolved_pair(single, duration)) is not None:
        single = data.fit(np.delete(single.poles, pair))
    if other.criterion() < single.criterion() - SIGNIFICANT:
        return leaking, other
    wide = -fit.poles.real * duration / np.pi > RESOLUTION
    return data, fit if len(single.poles) == len(fit.poles) or wide.all() else single


def _hann_duration(lines: Float[NDArray[np.float64], " f"]) -> float | None:
    """Duration of the window that evenly spaced lines belong to [s]; None for other lines."""
    step = float(np.diff(lines).min())
    number = lines / step
    return 1 / step if np.abs(number - np.round(number)).max() < UNEVEN else None


def _is_narrow(fit: ModalFit, duration: float) -> bool:
    """Whether leakage would be seen: some mode is no wider between its half-power points than a few lines."""
    return bool((-fit.poles.real * duration / np.pi < WIDE).any())


def _apart(poles: Complex[NDArray[np.complex128], " m"], duration: float) -> Complex[NDArray[np.complex128], " m"]:
    """One pole, the least damped, of those that leakage makes of one mode."""
    kept: list[complex] = []
    for pole in sorted(poles.tolist(), key=lambda each: -each.real):
        if all(abs(pole.imag - other.imag) * duration > 2 * np.pi * RESOLUTION for other in kept):
            kept.append(pole)
    return np.array(sorted(kept, key=lambda each: each.imag), dtype=np.complex128)


def _count_derivatives(quantity: str | Sequence[str], n_sensor: int) -> Powers:
    """Time derivatives of the displacement that each sensor measures, shape (c,)."""
    quantities = [quantity] * n_sensor if isinstance(quantity, str) else list(quantity)
    for each in quantities:
        if each not in DERIVATIVE:
            raise CampaignError(f'"{each}" is no quantity of a frequency response: give {", ".join(DERIVATIVE)}')
    if len(quantities) != n_sensor:
        raise CampaignError(f"{len(quantities)} quantities for {n_sensor} responses: give one, or one for each")
    return np.array([DERIVATIVE[each] for each in quantities], dtype=np.int64)


def _checked(
    frequency: Any, responses: Any, deviation: Any | None, band: tuple[float, float] | None
) -> tuple[
    Float[NDArray[np.float64], " f"], Complex[NDArray[np.complex128], "c f"], Complex[NDArray[np.complex128], "c f"] |
    None
]:  # fmt: skip
    """Lines of the band, responses and deviations there."""
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


def _choose(data: _Data, poles: Complex[NDArray[np.complex128], " m"], n_mode: int | None) -> ModalFit:
    """As many modes as the information criterion allows, or the number that is asked for."""
    lines, values = data.lines, data.values
    fit = _without_impossible(data, data.fit(poles))
    for _ in range(MOST_ADDED if n_mode is None else max(n_mode - len(fit.poles), 0)):
        left = np.abs(values - fit.fitted) ** 2 / fit.noise**2
        peak = lines[int(np.argmax(left.sum(axis=0)))]
        typical = float(np.median(-fit.poles.real / np.abs(fit.poles))) if len(fit.poles) else 0.01
        guess = 2 * np.pi * peak * (-typical + 1j)
        trial = data.fit(np.append(fit.poles, guess))
        worse = trial.criterion() > fit.criterion() - SIGNIFICANT or not _is_clear(lines, trial)
        if n_mode is None and (worse or _is_split(data, trial)):
            break
        fit = trial
    while len(fit.poles) > (n_mode or 0):
        if n_mode is None and data.duration and (pair := _unresolved_pair(fit, data.duration)) is not None:
            fit = data.fit(np.delete(fit.poles, pair))
            continue
        trials = [data.fit(np.delete(fit.poles, number)) for number in range(len(fit.poles))]
        best = min(trials, key=ModalFit.criterion)
        if n_mode is None and best.criterion() > fit.criterion() + SIGNIFICANT:
            break
        fit = best
    return fit


def _is_split(data: _Data, fit: ModalFit) -> bool:
    """Whether a mode under a window has become two."""
    return data.duration is not None and _unresolved_pair(fit, data.duration) is not None


def _unresolved_pair(fit: ModalFit, duration: float) -> int | None:
    """The weaker of two modes of one shape that a window of a duration [s] does not resolve; None without such a pair.

    Noise under a window moves all sensors alike, so that it looks like one more mode of the same shape.
    """
    order = np.argsort(fit.poles.imag)
    for first, second in pairwise(order.tolist()):
        one, other = fit.poles[first], fit.poles[second]
        near = abs(one.imag - other.imag) < max(-(one.real + other.real), 2 * np.pi * RESOLUTION / duration)
        shapes = fit.residues[:, [first, second]]
        if near and modal_assurance(shapes[:, :1], shapes[:, 1:])[0, 0] > ALIKE:
            size = np.linalg.norm(shapes, axis=0) / -fit.poles[[first, second]].real
            return int(second if size[1] < size[0] else first)
    return None


def _possible(lines: Float[NDArray[np.float64], " f"], fit: ModalFit) -> NDArray[np.bool_]:
    """Modes that decay, with some but not much damping, in the band or near it, and no narrower than its lines."""
    damping, own = -fit.poles.real / np.abs(fit.poles), np.abs(fit.poles) / (2 * np.pi)
    width = lines[-1] - lines[0]
    inside = (own > lines[0] - 0.1 * width) & (own < lines[-1] + 0.1 * width)
    between = np.interp(own, (lines[1:] + lines[:-1]) / 2, np.diff(lines))
    wide = 2 * damping * own > RESOLVED * between
    return np.asarray(wide & (damping < MOST_DAMPING) & inside)


def _is_clear(lines: Float[NDArray[np.float64], " f"], fit: ModalFit) -> bool:
    """Whether all modes are possible, and the damping of the last, which was added, is told from none."""
    deviation = float(np.sqrt(fit.pole_covariance[len(fit.poles) - 1, len(fit.poles) - 1]))
    return bool(_possible(lines, fit).all() and -fit.poles[-1].real > CLEAR * deviation)


def _without_impossible(data: _Data, fit: ModalFit) -> ModalFit:
    while not (possible := _possible(data.lines, fit)).all():
        fit = data.fit(fit.poles[possible])
    return fit


def _describe(data: _Data, fit: ModalFit, diagram: Stabilisation, driving_point: int | None, decay: float) -> Modes:
    """Frequencies, damping and shapes of the poles and residues."""
    values = data.values
    order = np.argsort(fit.poles.imag)
    poles, residues = fit.poles[order], fit.residues[:, order]
    m = len(poles)
    places = np.concatenate([order, m + order])
    excess = np.tile(_local_excess(data, fit)[order], 2)
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
            f"{plain(np.degrees(lag[k]), 3)} deg "
            "beside that of a structure with proportional damping: the force or its sign is not at this sensor"
            for k in np.flatnonzero(np.abs(lag) > np.pi / 4)
        ]
    if (poles.real >= 0).any():
        suspicions.append(
            f"an exponential window of {decay:.4g} 1/s leaves no damping: its rate is not that of the data"
        )
    s = 2j * np.pi * data.lines[:, None]
    parts = np.array(
        [
            [pole_response(s, each, power, data.duration)[0].T for each in (fit.poles[order], fit.poles[order].conj())]
            for power in data.power.tolist()
        ]
    )  # by sensor, pole and its conjugate, mode and line
    alone = [residues[:, k, None] * parts[:, 0, k] + residues[:, k, None].conj() * parts[:, 1, k] for k in range(m)]
    total = (np.abs(values) ** 2).sum(axis=1)
    damping_deviation = np.sqrt(np.diag(by_damping @ covariance @ by_damping.T))
    if data.duration is None:  # whether there is leakage is not told by so few lines
        unresolved = -fit.poles[order].real / np.pi < FEW_LINES * np.diff(data.lines).min()
        damping_deviation = np.where(unresolved, np.maximum(damping_deviation, -poles.real / size), damping_deviation)
    return Modes(
        frequency=size / (2 * np.pi),
        frequency_deviation=np.sqrt(np.diag(by_pole @ covariance @ by_pole.T)) / (2 * np.pi),
        damping_ratio=-poles.real / size,
        damping_deviation=damping_deviation,
        shapes=residues / largest,
        shape_deviation=fit.residue_deviation[:, order] / np.abs(largest),
        participation=np.array([((np.abs(part) ** 2).sum(axis=1) / total).mean() for part in alone]),
        residual=np.sqrt((np.abs(values - fit.fitted) ** 2).sum(axis=1) / total),
        fitted=fit.fitted,
        stabilisation=diagram,
        suspicions=tuple(suspicions),
        remarks=tuple(_describe_unresolved(data.lines, fit.poles[order])),
    )


def _local_excess(data: _Data, fit: ModalFit) -> Float[NDArray[np.float64], " m"]:
    """Variance of what is left at the lines of each mode over that of the noise, at least 1, shape (m,) [-].

    Leakage of noise is larger at a resonance than noise in proportion to the response is.
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
    """Modes that lie between lines."""
    step = float(np.diff(lines).min())
    for pole in poles.tolist():
        count = -pole.real / np.pi / step
        if count < FEW_LINES:
            yield (
                f"the mode at {abs(pole) / (2 * np.pi):.6g} Hz has {plain(count)} lines of {step:.4g} Hz within its "
                "half-power bandwidth: too few to tell one mode from two; its damping stems from the shape of the "
                "window: measure longer blocks"
            )
