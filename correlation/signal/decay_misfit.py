r"""Residual of the fitted modes of a decay, demodulated at the phase of one mode.

If the record contains :math:`A (1 + \varepsilon(t)) e^{i \varphi}` and the fit is :math:`A e^{i \varphi}`, the residual
times :math:`2 e^{-i \varphi} / A`, averaged over a few periods, is :math:`\varepsilon`. White noise of standard
deviation sigma gives it a known variance. An excess is not a function of the amplitude: coupled modes in slip, a lost
period, or another mode.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.signal.free_decay import Decay, estimate_noise
from correlation.signal.slow_flow import SlowFlowFit

Vector = Float[NDArray[np.float64], " k"]

#: Periods of one average under a Hann window, and number of averages whose mean scales a deviation.
PERIODS, NEIGHBOURS = 6.0, 5
#: Power of an average over the mean square of noise that noise exceeds with a probability of exp(-9) = 10^-4; for the
#: largest of k averages log(k) is added [-].
NOISE_RATIO = 9.0
#: Largest residual of a fit as a fraction of a mode's amplitude [-].
FOLLOWED = 0.02
#: Plausible range of damping ratios of a mode, and largest factor of its frequency change [-].
LEAST_DAMPING, MOST_DAMPING, MOST_CHANGE = -0.01, 0.3, 1.5
#: Fraction of the range in the logarithm of the amplitude that is not compared at either end: there the error of a
#: curve through a decay is largest, and exceeds its standard deviation [-].
ENDS = 0.08


@dataclass(frozen=True, kw_only=True, eq=False)
class DecayMisfit:
    """Residual of one mode at k instants.

    Parameters
    ----------
    time
        Time since the start of the fit, shape (k,) [s].
    share
        Amplitude of the residual beyond noise over that of the mode, shape (k,).
    excess
        Root of the residual power near the frequency of the mode over that of white noise with the size of the whole
        residual, shape (k,).
    """

    time: Vector
    share: Vector
    excess: Vector

    def widen(self, time: Vector, deviation: Vector) -> Vector:
        """Standard deviations of relative frequencies or damping ratios at some times, including the misfit.

        The fit gives them for white noise of the residual's size. A change of `share` within half of one average
        changes frequency and damping by this amount over the phase angle of that time.
        """
        excess = np.maximum(np.interp(time, self.time, self.excess), 1.0)
        near = np.pad(self.share, 1, mode="edge")
        share = np.maximum(np.maximum(near[:-2], near[2:]), self.share)
        return np.hypot(deviation * excess, np.interp(time, self.time, share) / (np.pi * PERIODS))


def measure_misfit(decay: Decay, fit: SlowFlowFit, number: int) -> DecayMisfit:
    """Measure the residual at the phase of a mode, from the start until the mode has decayed to the noise."""
    flow, step = fit.flows[number], decay.step
    wave, _ = flow.linearise(flow.coefficients, step)
    n = min(decay.n_sample(number), flow.n_sample, len(fit.residual))
    width = min(max(round(PERIODS / decay.frequencies[number] / step), 8), n)
    window = np.hanning(width + 2)[1:-1]
    starts = np.unique(np.linspace(0, n - width, max(2 * (n - width) // width, 1) + 1).astype(int))
    size = np.abs(wave)
    turned = fit.residual[:n] * (wave[:n].conj() / np.maximum(size[:n], 1e-300))
    left = np.array([abs(2 * window @ turned[a : a + width]) / window.sum() for a in starts])
    amplitude = np.array([window @ size[a : a + width] / window.sum() for a in starts])
    of_noise = 4 * (window**2).sum() / window.sum() ** 2
    noise = estimate_noise(fit.residual, step) ** 2 * of_noise
    by_chance = (NOISE_RATIO + np.log(len(starts))) * noise
    share = np.sqrt(np.maximum(left**2 - by_chance, 0.0)) / np.maximum(amplitude, 1e-300)
    white = max(float((fit.residual**2).mean()) * of_noise, 1e-300)
    padded = np.pad(left**2 / white, NEIGHBOURS // 2, mode="edge")
    excess = np.sqrt(np.convolve(padded, np.ones(NEIGHBOURS) / NEIGHBOURS, mode="valid"))
    return DecayMisfit(time=(starts + (width - 1) / 2) * step, share=share, excess=excess)


def find_fault(misfit: DecayMisfit, frequency: Vector, damping_ratio: Vector, damping_deviation: Vector) -> str:
    """Reason why a fitted component is no mode, as the end of a sentence; empty if it is one.

    Parameters
    ----------
    misfit
        Residual of the mode.
    frequency, damping_ratio, damping_deviation
        Values at logarithmically spaced amplitudes, shape (k,) [Hz, -, -].
    """
    edge = int(ENDS * len(frequency))
    inner = slice(edge, len(frequency) - edge)
    low, high = float(frequency[inner].min()), float(frequency[inner].max())
    least, most = float(damping_ratio[inner].min()), float(damping_ratio[inner].max())
    if not (low > 0 and high < MOST_CHANGE * low):
        return f"would run from {low:.4g} to {high:.4g} Hz"
    if not (least > LEAST_DAMPING and most < MOST_DAMPING):
        return f"would have damping ratios from {100 * least:.3g} to {100 * most:.3g} %"
    vague = float(damping_deviation[inner].max())
    if not vague < MOST_DAMPING:
        return f"would have damping ratios that are uncertain by {100 * vague:.2g} %"
    worst = int(np.argmax(misfit.share))
    if misfit.share[worst] > FOLLOWED:
        left = f"{100 * misfit.share[worst]:.2g} % of its amplitude"
        return f"would differ from the record by up to {left}, more than the {100 * FOLLOWED:g} % that a mode may"
    return ""
