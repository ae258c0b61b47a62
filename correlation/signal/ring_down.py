r"""Frequency and damping against amplitude from a free decay, mode by mode.

A mode that decays slowly is :math:`x(t) = A(t) \cos \varphi(t)` with harmonics. Its frequency is that of the phase. Its
damping follows from the action :math:`J \propto \omega A^2` rather than from the amplitude: if the frequency depends on
the amplitude, A changes with it even without any dissipation, but the action does not (an adiabatic invariant). So

.. math:: \zeta \omega = -\tfrac{1}{2} \frac{\mathrm{d}}{\mathrm{d}t} \ln (\omega A^2)

with A the first harmonic of the displacement. This is the damping ratio that harmonic balance gives for the steady
state of the same amplitude at phase resonance, to first order of damping and of the change of frequency per period. An
acceleration is brought to a displacement by :math:`\omega^2`, which changes its rate of decay as well.

The first half period after a release is left out: friction moves along its virgin curve there, not along its loop.

References
----------
Landau and Lifshitz, Mechanics, 3rd ed. (1976), section 49.
Londoño, Neild and Cooper, Identification of backbone curves of nonlinear systems from resonance decay responses,
J. Sound Vib. 348 (2015) 224.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.model import DERIVATIVE
from correlation.signal.decay_flow import Flow, FlowFit, fit_flows
from correlation.signal.decay_misfit import find_fault, measure_misfit
from correlation.signal.record import check_channels, check_time, uniform_step
from correlation.signal.release import Decay, estimate_noise, find_decay, first_guess, new_tone, strong_harmonic
from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " k"]

#: Spline intervals of the first fit that is not linear, and splits at most. The search ends when so many splits in a
#: row have not improved the information criterion by so much; no interval is shorter in ln A.
FIRST_INTERVALS, MOST_INTERVALS, PATIENCE, SIGNIFICANT, SHORTEST_INTERVAL = 3, 24, 3, 4.0, 0.1
#: Parts of a decay to which the first splines are fitted one after the other, and fewest samples per coefficient there.
#: Each is longer by a quarter: over a longer part the frequency that a spline foretells may lose a period.
TRACKED, FEWEST_TRACKED = tuple(np.geomspace(0.04, 1.0, 16).tolist()), 2
#: Standard deviation of frequencies that are read off an envelope, relative; of decay rates it is 20 times as much [-].
PRIOR = 0.02
#: Residual beside the signal at which a fit is as good as any measurement [-].
EXACT = 5e-4
#: Residual of modes beside the signal above which another one is tried first: near one of them, where a nonlinear mode
#: leaves lines of its own, and elsewhere; what is near, over the frequency [-].
BEATS, BEATS_AFAR, NEAR = 0.1, 0.01, 0.2
#: Share of the power above noise that another mode may leave at most, or it is none; and before splines are refined.
MUST_EXPLAIN, MUST_EXPLAIN_BEAT = 0.7, 0.25
#: Harmonics of a mode that are fitted beside it, and points of a result.
HARMONICS, N_POINT = (2, 3, 5), 60
#: Most modes that are looked for where their number is not given.
MOST_MODES = 4
#: Where modes do not follow their own amplitudes, the decay is read from so many periods of its lowest mode later on;
#: largest share of it that is left out so [-].
LATER, MOST_LEFT_OUT = (2.0, 8.0, 32.0), 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class RingDown:
    """A mode during its free decay, at k instants with falling amplitude.

    Parameters
    ----------
    time
        Shape (k,) [s].
    amplitude, amplitude_deviation
        Of the first harmonic of the signal, peak, shape (k,) [unit of the signal].
    displacement
        The same of the displacement, shape (k,) [unit of the signal times s or s^2].
    frequency, frequency_deviation
        Undamped, shape (k,) [Hz].
    damping_ratio, damping_deviation
        Shape (k,) [-].
    start, end
        First and last instant used [s].
    noise_floor
        Amplitude below which a mode vanishes in the noise [unit of the signal].
    residual
        Root mean square of what all modes leave, over that of the signal [-].
    remarks
        How the record was read, in words.
    """

    time: Values
    amplitude: Values
    amplitude_deviation: Values
    displacement: Values
    frequency: Values
    frequency_deviation: Values
    damping_ratio: Values
    damping_deviation: Values
    start: float
    end: float
    noise_floor: float
    residual: float
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(
            self, "time", "amplitude", "amplitude_deviation", "displacement", "frequency", "frequency_deviation",
            "damping_ratio", "damping_deviation",
        )  # fmt: skip


def analyse_ring_down(
    time: Any,
    values: Any,
    *,
    quantity: str = "displacement",
    start: float | None = None,
    end: float | None = None,
    frequencies: Sequence[float] | None = None,
) -> tuple[RingDown, ...]:
    """Frequency and damping against amplitude of every mode in a free decay.

    Parameters
    ----------
    time
        Instants at one rate, shape (n,) [s].
    values
        Signal, shape (n,) [any unit].
    quantity
        "displacement", "velocity" or "acceleration".
    start, end
        Part of the record to be used [s]; by default from half a period after the release, or from where each mode
        follows its own amplitude, to where the modes vanish in the noise.
    frequencies
        Modes to be fitted, roughly [Hz]; by default those that stand out.

    Returns
    -------
    The modes, by rising frequency.

    Raises
    ------
    CampaignError
        A clock that is not uniform, an unknown quantity, no decay in the record, or no mode that it follows.
    """
    cut = partial(cut_decay, time, values, quantity=quantity, end=end, frequencies=frequencies)
    decay = cut(start=start)
    best = first = _read_modes(decay, frequencies is None, DERIVATIVE[quantity])
    for later in LATER if start is None else ():
        skip = later / min(first.decay.frequencies)
        if not best.faults or skip > MOST_LEFT_OUT * len(decay.values) * decay.step:
            break
        trial = _read_modes(cut(start=decay.start + skip), frequencies is None, DERIVATIVE[quantity])
        if not trial.faults or len(trial.modes) > len(best.modes):
            best = trial
    if not best.modes:
        raise CampaignError(
            f"no mode of this decay can be read from {best.decay.start:.4g} s on: {best.faults[0]}; give the start of "
            "a part in which modes decay freely, or their frequencies"
        )
    remarks = [f"{fault}, and is left out" for fault in best.faults]
    if best is not first:
        remarks.append(
            f"the decay is read from {best.decay.start:.4g} s on: before, its modes do not follow their own "
            f'amplitudes, as where several slip at once; start = "{best.decay.start:.4g} s" in the manifest keeps it so'
        )
    modes = [replace(mode, remarks=tuple(remarks)) for mode in best.modes]
    return tuple(sorted(modes, key=lambda mode: float(mode.frequency[-1])))


class _Reading(NamedTuple):
    """Modes that the record follows, and what is wrong with the others."""

    decay: Decay
    modes: list[RingDown]
    faults: list[str]


def _read_modes(decay: Decay, adds: bool, power: int) -> _Reading:
    """All modes from one start on."""
    fit, decay = _fit_modes(decay, adds)
    modes, faults = [], []
    for number in range(len(decay.frequencies)):
        misfit = measure_misfit(decay, fit, number)
        mode = _describe(decay, fit, number, power)
        fault = find_fault(misfit, mode.frequency, mode.damping_ratio, mode.damping_deviation)
        if fault:
            faults.append(f"a mode at {decay.frequencies[number]:.4g} Hz {fault}")
            continue
        passed = mode.time - decay.start
        modes.append(
            replace(
                mode,
                frequency_deviation=mode.frequency * misfit.widen(passed, mode.frequency_deviation / mode.frequency),
                damping_deviation=misfit.widen(passed, mode.damping_deviation),
            )
        )
    return _Reading(decay, modes, faults)


def cut_decay(
    time: Any,
    values: Any,
    *,
    quantity: str = "displacement",
    start: float | None = None,
    end: float | None = None,
    frequencies: Sequence[float] | None = None,
) -> Decay:
    """What `analyse_ring_down` fits modes to, with its checks: it takes a small part of the time of the fit."""
    if quantity not in DERIVATIVE:
        raise CampaignError(f'"{quantity}" is no quantity of a ring-down: give {", ".join(DERIVATIVE)}')
    channel = check_channels(values)
    if len(channel) != 1:
        raise CampaignError(f"values have shape {np.shape(values)}: give the samples of one channel, shape (n,)")
    instants = check_time(time, channel.shape[1], fewest=32)
    return find_decay(instants, channel[0], uniform_step(instants), start, end, frequencies)


def _fit_modes(decay: Decay, adds: bool) -> tuple[FlowFit, Decay]:
    """The fit with as many modes and spline intervals as the data call for."""
    quick = _first_fit(decay)
    tried: dict[tuple[float, ...], FlowFit] = {decay.frequencies: quick}

    def fit_first(more: Decay) -> FlowFit:
        if more.frequencies not in tried:
            tried[more.frequencies] = _first_fit(more)
        return tried[more.frequencies]

    # A beat is no nonlinearity: where one mode leaves much, a second is tried before its splines are refined.
    while adds and len(decay.frequencies) < MOST_MODES:
        tone = new_tone(decay, quick.residual)
        if tone is None:
            break
        near = any(abs(tone / own - 1) < NEAR for own in decay.frequencies)
        if _share(quick, decay) < (BEATS if near else BEATS_AFAR):
            break
        more = decay.with_frequency(tone)
        trial = fit_first(more)
        if _left(trial, quick, decay) > MUST_EXPLAIN_BEAT:
            break
        decay, quick = more, trial
    # What stands at a harmonic may be a mode of its own: it is if a mode explains it with fewer coefficients.
    while adds and len(decay.frequencies) < MOST_MODES and (tone := strong_harmonic(decay, HARMONICS)) is not None:
        more = decay.with_frequency(tone)
        trial = fit_first(more)
        if trial.criterion > quick.criterion - SIGNIFICANT:
            break
        decay, quick = more, trial
    best = _refined(decay, quick)
    while adds and len(decay.frequencies) < MOST_MODES:
        tone = new_tone(decay, best.residual)
        if tone is None:
            break
        more = decay.with_frequency(tone)
        trial = _refined(more, fit_first(more))
        if _left(trial, best, decay) > MUST_EXPLAIN:
            break
        decay, best = more, trial
    return best, decay


def _left(trial: FlowFit, before: FlowFit, decay: Decay) -> float:
    """Power that a fit with one mode more leaves above noise, over what the fit before left [-]."""
    noise = estimate_noise(trial.residual, decay.step) ** 2
    least = 1e-3 * float((before.residual**2).mean())
    with_mode, without = (max(float((fit.residual**2).mean()) - noise, least) for fit in (trial, before))
    return with_mode / without


def _share(fit: FlowFit, decay: Decay) -> float:
    """Root mean square of a residual beside the signal's [-]."""
    return float(np.sqrt((fit.residual**2).sum() / (decay.values**2).sum()))


def _first_fit(decay: Decay) -> FlowFit:
    """Linear modes, or splines of a few intervals where the information criterion prefers them."""
    linear = fit_flows(decay.values, decay.step, _track(decay, first_guess(decay, HARMONICS, 0)))
    bent = fit_flows(decay.values, decay.step, _track(decay, first_guess(decay, HARMONICS, FIRST_INTERVALS)))
    return bent if bent.criterion < linear.criterion - SIGNIFICANT else linear


def _refined(decay: Decay, best: FlowFit) -> FlowFit:
    """The fit with ever more spline intervals where they are needed, until the information criterion is content."""
    fit, worse = best, 0
    if best.flows[0].degree == 0:
        return best
    for _ in range(MOST_INTERVALS):
        split = _split(decay, fit)
        if split is None or _share(fit, decay) < EXACT:
            break
        fit = fit_flows(decay.values, decay.step, split)
        if fit.criterion < best.criterion - SIGNIFICANT:
            best, worse = fit, 0
        else:
            worse += 1
        if worse == PATIENCE:
            break
    return best


def _track(decay: Decay, flows: list[Flow]) -> list[Flow]:
    """Flows that keep step with the phases: fitted to the beginning of the decay, then to ever more of it."""
    # A linear mode has one frequency: it may be foretold over a time twice as long.
    for share in TRACKED if flows[0].degree else TRACKED[::3]:
        n = round(share * len(decay.values))
        if n < FEWEST_TRACKED * len(flows) * len(flows[0].coefficients):
            continue
        shorter = [replace(flow, n_sample=min(flow.n_sample, n)) for flow in flows]
        fit = fit_flows(decay.values[:n], decay.step, shorter, PRIOR)
        flows = [replace(flow, coefficients=found.coefficients) for flow, found in zip(flows, fit.flows, strict=True)]
    return flows


def _split(decay: Decay, fit: FlowFit) -> list[Flow] | None:
    """The fitted modes with one interval more, where the residual is largest; None if all intervals are short."""
    worst, place = 0.0, None
    for number, flow in enumerate(fit.flows):
        time, logarithm, _ = flow.path(flow.coefficients)
        # Samples at which the amplitude passes the break points, from the largest amplitude down.
        passed = np.interp(-flow.breaks[::-1], -logarithm, time) / decay.step
        bounds = np.clip(np.round(passed), 0, flow.n_sample).astype(int)
        for interval, (a, b) in enumerate(pairwise(bounds)):
            energy = float((fit.residual[a:b] ** 2).sum())
            from_below = len(flow.breaks) - 2 - interval
            wide = flow.breaks[from_below + 1] - flow.breaks[from_below] > SHORTEST_INTERVAL
            if wide and (b - a) * decay.step * decay.frequencies[number] > 2 and energy > worst:
                worst, place = energy, (number, from_below)
    if place is None:
        return None
    flows = list(fit.flows)
    flow = flows[place[0]]
    breaks = np.insert(flow.breaks, place[1] + 1, (flow.breaks[place[1]] + flow.breaks[place[1] + 1]) / 2)
    finer = replace(flow, breaks=breaks)
    fine = np.linspace(breaks[0], breaks[-1], 20 * len(breaks))
    count = (len(flow.coefficients) - 2) // 2
    coarse, basis = flow.basis(fine), finer.basis(fine)
    moved = [
        np.linalg.lstsq(basis, coarse @ part, rcond=None)[0]
        for part in (flow.coefficients[2 : 2 + count], flow.coefficients[2 + count :])
    ]
    flows[place[0]] = replace(finer, coefficients=np.concatenate([flow.coefficients[:2], *moved]))
    return flows


def _describe(decay: Decay, fit: FlowFit, number: int, power: int) -> RingDown:
    """Frequency and damping of one mode with their standard deviations, from its flow."""
    flow, covariance = fit.flows[number], fit.covariance[number]
    time, logarithm, _ = flow.path(flow.coefficients)
    span = decay.duration(number)
    last = float(np.interp(span, time, logarithm))
    at = np.linspace(logarithm[0], last, N_POINT)
    count = (len(flow.coefficients) - 2) // 2
    values, slopes = flow.basis(at), flow.basis(at, derivative=1)
    rate = np.exp(values @ flow.coefficients[2 : 2 + count])
    omega, bend = values @ flow.coefficients[2 + count :], slopes @ flow.coefficients[2 + count :]
    # Decay of the action of the displacement, (1/2) d ln(omega A^2): A is that of the signal, omega^power times as
    # large.
    excess = 0.5 - power
    factor = 1 + excess * bend / omega
    decay_rate = rate * factor
    undamped = np.hypot(omega, decay_rate)
    by_omega = np.hstack([np.zeros((N_POINT, 2 + count)), values])
    by_bend = excess * (slopes / omega[:, None] - values * (bend / omega**2)[:, None])
    by_rate = np.hstack([np.zeros((N_POINT, 2)), values * decay_rate[:, None], by_bend * rate[:, None]])
    by_start = np.zeros((N_POINT, len(flow.coefficients)))
    by_start[:, 0] = 1.0
    omega_deviation, decay_deviation, relative = (
        np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", slope, covariance, slope), 0.0))
        for slope in (by_omega, by_rate, by_start)
    )
    # Within half a period the loop of a decay is not that of a steady state of its amplitude: what the damping changes
    # by in that time is not known.
    passing = np.abs(np.gradient(decay_rate, at)) * rate * np.pi / omega
    amplitude = np.exp(at)
    return RingDown(
        time=decay.start + np.interp(-at, -logarithm, time),
        amplitude=amplitude,
        amplitude_deviation=amplitude * relative,
        displacement=amplitude / undamped**power,
        frequency=undamped / (2 * np.pi),
        frequency_deviation=omega_deviation / (2 * np.pi),
        damping_ratio=decay_rate / undamped,
        damping_deviation=np.hypot(decay_deviation, passing) / undamped,
        start=decay.start,
        end=decay.start + span,
        noise_floor=decay.floor,
        residual=float(np.sqrt((fit.residual**2).mean() / (decay.values**2).mean())),
    )
