"""Fit of the slow flow of a free decay, with as many modes and spline intervals as the record supports."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from correlation.signal.free_decay import Decay, estimate_noise, find_new_tone, find_strong_harmonic, guess_modes
from correlation.signal.slow_flow import SlowFlow, SlowFlowFit, fit_slow_flows

#: Number of spline intervals of the first nonlinear fit, and its largest number; number of consecutive splits without
#: this improvement of the information criterion that ends the search; shortest interval in ln A.
FIRST_INTERVALS, MOST_INTERVALS, PATIENCE, SIGNIFICANT, SHORTEST_INTERVAL = 3, 24, 3, 4.0, 0.1
#: Parts of a decay to which the first splines are fitted successively, and least number of samples per coefficient.
#: Each part is a quarter longer: in a longer part the extrapolated frequency of a spline may lose a period.
TRACKED, FEWEST_TRACKED = tuple(np.geomspace(0.04, 1.0, 16).tolist()), 2
#: Relative standard deviation of frequencies estimated from an envelope; that of decay rates is 20 times as large [-].
PRIOR = 0.02
#: Relative residual at which a fit is as good as any measurement [-].
EXACT = 5e-4
#: Number of splits over which the decrease of a residual is measured [-].
PACE = 6
#: Relative residual above which another mode is tried first: near a fitted mode, where a nonlinear mode has further
#: lines, and elsewhere; relative distance that counts as near [-].
BEATS, BEATS_AFAR, NEAR = 0.1, 0.01, 0.2
#: Largest fraction of the power above noise that remains after an additional mode: in general, and before splines are
#: refined [-].
MUST_EXPLAIN, MUST_EXPLAIN_BEAT = 0.7, 0.25
#: Harmonics that are fitted with a mode.
HARMONICS = (2, 3, 5)
#: Largest number of modes that are searched if their number is not given.
MOST_MODES = 4


def fit_modes(decay: Decay, adds: bool) -> tuple[SlowFlowFit, Decay]:
    """Fit the slow flow with as many modes and spline intervals as the data support.

    Parameters
    ----------
    decay
        Part of a record with approximate frequencies of its modes.
    adds
        Whether to search for further modes.

    Returns
    -------
    The fit, and the decay with the added modes.
    """
    tried: dict[tuple[float, ...], SlowFlowFit] = {}

    def fit_first(more: Decay) -> SlowFlowFit:
        if more.frequencies not in tried:
            tried[more.frequencies] = _choose_first_fit(more)
        return tried[more.frequencies]

    fit = fit_first(decay)
    if not adds:
        return _refine_fit(decay, fit), decay
    # A beat must not be fitted as nonlinearity: with a large residual a second mode is tried before splines are
    # refined.
    fit, decay = _add_modes(
        decay, fit, find_tone=_find_beat, fit_more=fit_first,
        explains=lambda trial, before, own: _compute_power_ratio(trial, before, own) < MUST_EXPLAIN_BEAT,
    )  # fmt: skip
    # A line at a harmonic may be a separate mode: it is if a mode explains it with fewer coefficients.
    fit, decay = _add_modes(
        decay, fit, find_tone=lambda own, _: find_strong_harmonic(own, HARMONICS), fit_more=fit_first,
        explains=lambda trial, before, _: trial.criterion < before.criterion - SIGNIFICANT,
    )  # fmt: skip
    return _add_modes(
        decay, _refine_fit(decay, fit), find_tone=lambda own, before: find_new_tone(own, before.residual),
        fit_more=lambda more: _refine_fit(more, fit_first(more)),
        explains=lambda trial, before, own: _compute_power_ratio(trial, before, own) < MUST_EXPLAIN,
    )  # fmt: skip


def _add_modes(
    decay: Decay,
    fit: SlowFlowFit,
    find_tone: Callable[[Decay, SlowFlowFit], float | None],
    fit_more: Callable[[Decay], SlowFlowFit],
    explains: Callable[[SlowFlowFit, SlowFlowFit, Decay], bool],
) -> tuple[SlowFlowFit, Decay]:
    """The fit with modes added one at a time, as long as there is a tone that a mode explains."""
    while len(decay.frequencies) < MOST_MODES and (tone := find_tone(decay, fit)) is not None:
        more = decay.with_frequency(tone)
        trial = fit_more(more)
        if not explains(trial, fit, decay):
            break
        decay, fit = more, trial
    return fit, decay


def _find_beat(decay: Decay, fit: SlowFlowFit) -> float | None:
    """A tone in a large residual of the modes [Hz]; None without one."""
    tone = find_new_tone(decay, fit.residual)
    if tone is None:
        return None
    near = any(abs(tone / own - 1) < NEAR for own in decay.frequencies)
    return tone if _compute_relative_residual(fit, decay) >= (BEATS if near else BEATS_AFAR) else None


def _compute_power_ratio(trial: SlowFlowFit, before: SlowFlowFit, decay: Decay) -> float:
    """Residual power above noise of a fit with one more mode, over that of the previous fit [-]."""
    noise = estimate_noise(trial.residual, decay.step) ** 2
    least = 1e-3 * float((before.residual**2).mean())
    with_mode, without = (max(float((fit.residual**2).mean()) - noise, least) for fit in (trial, before))
    return with_mode / without


def _compute_relative_residual(fit: SlowFlowFit, decay: Decay) -> float:
    """Root mean square of a residual over that of the signal [-]."""
    return float(np.sqrt((fit.residual**2).sum() / (decay.values**2).sum()))


def _compute_excess(fit: SlowFlowFit, decay: Decay) -> float:
    """Logarithm of a residual over its least attainable value: white noise, or an exact fit [-]."""
    noise = estimate_noise(fit.residual, decay.step) / float(np.sqrt((decay.values**2).mean()))
    return float(np.log(_compute_relative_residual(fit, decay) / max(noise, EXACT)))


def _choose_first_fit(decay: Decay) -> SlowFlowFit:
    """Linear modes, or splines with a few intervals if the information criterion prefers them."""
    linear = fit_slow_flows(decay.values, decay.step, _track(decay, guess_modes(decay, HARMONICS, 0)))
    bent = fit_slow_flows(decay.values, decay.step, _track(decay, guess_modes(decay, HARMONICS, FIRST_INTERVALS)))
    return bent if bent.criterion < linear.criterion - SIGNIFICANT else linear


def _refine_fit(decay: Decay, best: SlowFlowFit) -> SlowFlowFit:
    """Refine the splines where the residual is largest, until the information criterion no longer falls.

    A residual that does not decrease fast enough to reach the noise is not caused by functions of the amplitude.
    """
    fit, worse, size = best, 0, [_compute_excess(best, decay)]
    if best.flows[0].degree == 0:
        return best
    for left in range(MOST_INTERVALS, 0, -1):
        split = _split(decay, fit)
        if split is None or _compute_relative_residual(fit, decay) < EXACT or not _converges_fast_enough(size, left):
            break
        fit = fit_slow_flows(decay.values, decay.step, split)
        size.append(_compute_excess(fit, decay))
        if fit.criterion < best.criterion - SIGNIFICANT:
            best, worse = fit, 0
        else:
            worse += 1
        if worse == PATIENCE:
            break
    return best


def _converges_fast_enough(size: Sequence[float], left: int) -> bool:
    """Whether a residual falls fast enough to reach the noise within the remaining splits."""
    return len(size) <= PACE or size[-1] * PACE <= (size[-1 - PACE] - size[-1]) * left


def _track(decay: Decay, flows: list[SlowFlow]) -> list[SlowFlow]:
    """Track the phases: fit the flows to the beginning of the decay, then to increasingly longer parts."""
    # A linear mode has one frequency, which can be extrapolated over twice the time.
    for share in TRACKED if flows[0].degree else TRACKED[::3]:
        n = round(share * len(decay.values))
        if n < FEWEST_TRACKED * len(flows) * len(flows[0].coefficients):
            continue
        shorter = [replace(flow, n_sample=min(flow.n_sample, n)) for flow in flows]
        fit = fit_slow_flows(decay.values[:n], decay.step, shorter, PRIOR)
        flows = [replace(flow, coefficients=result.coefficients) for flow, result in zip(flows, fit.flows, strict=True)]
    return flows


def _split(decay: Decay, fit: SlowFlowFit) -> list[SlowFlow] | None:
    """The fitted modes with one more interval, where the residual is largest; None if all intervals are short."""
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
