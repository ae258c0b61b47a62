"""Selection of the number of modes, and of the window of the frequency responses, by an information criterion."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from correlation.modal.assurance import compute_modal_assurance
from correlation.modal.modal_model import Frequencies, ModalFit, Poles, Powers, Responses, fit_poles
from correlation.modal.stabilisation import MOST_DAMPING
from correlation.modal.window import Window

#: Least improvement of the information criterion by a mode that is kept.
SIGNIFICANT = 10.0
#: Largest number of modes that are added at peaks of the residual.
MOST_ADDED = 4
#: Least half-power bandwidth of a mode over the distance of lines; a narrower one is a single line [-].
RESOLVED = 0.1
#: MAC above which two modes have the same shape [-].
SAME_SHAPE = 0.9
#: Tolerance of lines that are multiples of their distance, as a share of it [-].
UNEVEN = 1e-2
#: Bandwidth in lines above which leakage is negligible (it changes the width by less than 1 %), and half the width of
#: the main lobe of a Hann window in lines: peaks closer than this are not resolved [-].
WIDE_MODE, RESOLUTION = 20.0, 2.0
#: Least damping of an added mode in its standard deviations: noise has peaks of any width.
CLEAR_DAMPING = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseData:
    """Responses of a band, with data for the fit.

    Parameters
    ----------
    lines, values, spread
        As in `fit_poles`, shape (f,), (c, f) and (c, f).
    power
        Time derivatives of the displacement that each sensor measures, shape (c,).
    duration
        Duration of the Hann window [s]; None for no leakage.
    """

    lines: Frequencies
    values: Responses
    spread: Responses | None
    power: Powers
    duration: float | None = None

    def leaks(self, fit: ModalFit) -> bool:
        """Whether leakage of the window changed the responses of a mode."""
        return self.duration is not None and _is_narrow(fit, self.duration)

    def fit(self, poles: Poles) -> ModalFit:
        """Poles and residues from initial guesses of the poles."""
        return fit_poles(self.lines, self.values, poles, self.power, self.spread, self.duration)


def choose_modes(data: ResponseData, poles: Poles, n_mode: int | None, window: Window) -> tuple[ResponseData, ModalFit]:
    """The modes for the given window; if it is unknown, for the one that explains the responses better.

    Parameters
    ----------
    data
        Responses of the band.
    poles
        Initial guesses, shape (m,) [rad/s].
    n_mode
        Number of modes; None to choose it by the criterion.
    window
        Window of the estimate of the responses.
    """
    duration = _find_hann_duration(data.lines)
    leaking = replace(data, duration=duration)
    if window is Window.HANN and duration is not None:
        return leaking, _choose(leaking, _merge_poles(poles, duration), n_mode)
    fit = _choose(data, poles, n_mode)
    if window is not Window.UNKNOWN or duration is None or not _is_narrow(fit, duration):
        return data, fit
    # Leakage imitates pairs of modes: with leakage a single mode explains the responses better than without it.
    other, single = _choose(leaking, _merge_poles(poles, duration), n_mode), fit
    while n_mode is None and (pair := _find_unresolved_mode(single, duration)) is not None:
        single = data.fit(np.delete(single.poles, pair))
    if other.criterion() < single.criterion() - SIGNIFICANT:
        return leaking, other
    wide = -fit.poles.real * duration / np.pi > RESOLUTION
    return data, fit if len(single.poles) == len(fit.poles) or wide.all() else single


def _find_hann_duration(lines: Frequencies) -> float | None:
    """Duration of the window for evenly spaced lines [s]; None for other lines."""
    step = float(np.diff(lines).min())
    number = lines / step
    return 1 / step if np.abs(number - np.round(number)).max() < UNEVEN else None


def _is_narrow(fit: ModalFit, duration: float) -> bool:
    """Whether leakage would be significant: the half-power bandwidth of a mode is less than `WIDE_MODE` lines."""
    return bool((-fit.poles.real * duration / np.pi < WIDE_MODE).any())


def _merge_poles(poles: Poles, duration: float) -> Poles:
    """Merge poles that are one mode with leakage; the least damped one is kept."""
    kept: list[complex] = []
    for pole in sorted(poles.tolist(), key=lambda item: -item.real):
        if all(abs(pole.imag - other.imag) * duration > 2 * np.pi * RESOLUTION for other in kept):
            kept.append(pole)
    return np.array(sorted(kept, key=lambda item: item.imag), dtype=np.complex128)


def _choose(data: ResponseData, poles: Poles, n_mode: int | None) -> ModalFit:
    """Modes selected by the information criterion, or the requested number of modes."""
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
        if n_mode is None and data.duration and (pair := _find_unresolved_mode(fit, data.duration)) is not None:
            fit = data.fit(np.delete(fit.poles, pair))
            continue
        trials = [data.fit(np.delete(fit.poles, number)) for number in range(len(fit.poles))]
        best = min(trials, key=ModalFit.criterion)
        if n_mode is None and best.criterion() > fit.criterion() + SIGNIFICANT:
            break
        fit = best
    return fit


def _is_split(data: ResponseData, fit: ModalFit) -> bool:
    """Whether the fit contains a pair of modes that the window does not resolve."""
    return data.duration is not None and _find_unresolved_mode(fit, data.duration) is not None


def _find_unresolved_mode(fit: ModalFit, duration: float) -> int | None:
    """Index of the weaker of two modes of equal shape that a window of this duration [s] does not resolve, or None.

    Noise under a window is correlated between sensors and thus imitates an additional mode of the same shape.
    """
    order = np.argsort(fit.poles.imag)
    for first, second in pairwise(order.tolist()):
        one, other = fit.poles[first], fit.poles[second]
        near = abs(one.imag - other.imag) < max(-(one.real + other.real), 2 * np.pi * RESOLUTION / duration)
        shapes = fit.residues[:, [first, second]]
        if near and compute_modal_assurance(shapes[:, :1], shapes[:, 1:])[0, 0] > SAME_SHAPE:
            size = np.linalg.norm(shapes, axis=0) / -fit.poles[[first, second]].real
            return int(second if size[1] < size[0] else first)
    return None


def _find_possible(lines: Frequencies, fit: ModalFit) -> NDArray[np.bool_]:
    """Mask of modes with plausible damping, in or near the band, and with a bandwidth that the lines can show."""
    damping, own = -fit.poles.real / np.abs(fit.poles), np.abs(fit.poles) / (2 * np.pi)
    width = lines[-1] - lines[0]
    inside = (own > lines[0] - 0.1 * width) & (own < lines[-1] + 0.1 * width)
    between = np.interp(own, (lines[1:] + lines[:-1]) / 2, np.diff(lines))
    wide = 2 * damping * own > RESOLVED * between
    return np.asarray(wide & (damping < MOST_DAMPING) & inside)


def _is_clear(lines: Frequencies, fit: ModalFit) -> bool:
    """Whether all modes are possible, and the damping of the last one, which was added, is significant."""
    deviation = float(np.sqrt(fit.pole_covariance[len(fit.poles) - 1, len(fit.poles) - 1]))
    return bool(_find_possible(lines, fit).all() and -fit.poles[-1].real > CLEAR_DAMPING * deviation)


def _without_impossible(data: ResponseData, fit: ModalFit) -> ModalFit:
    while not (possible := _find_possible(data.lines, fit)).all():
        fit = data.fit(fit.poles[possible])
    return fit
