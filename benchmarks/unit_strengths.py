r"""Unit strengths of the hidden effects of the virtual test bench: strengths at which they become visible.

The features of the training part of a campaign (without held-out levels and repeats), as means over repeats and sweeps,
are D = F / X_1 and X_3 / X_1 of each motion sensor and the harmonics of the forces of each line. Their covariance is
that of the mean over the R repeats: noise of the readings, and the scatter of many repeats by jitter and history,

.. math:: \Sigma = \Sigma_\mathrm{noise} + \frac{1}{R} \bigl(S + a\, \mathrm{diag}\, S\bigr)

with the sample covariance S, which is of low rank, and a fraction a of its diagonal for scatter that is not in the
samples. With features y(effect, p) of the calibration parameters p (kt, kn, mu, zeta, E, bearing), the residual after
refitting them is

.. math:: \rho = \min_p \bigl|\Sigma^{-1/2} \bigl(y(\mathrm{effect}, p) - y(\mathrm{nothing}, 0)\bigr)\bigr|

by the Gauss-Newton method with Broyden's update of the slopes. The unit strength gives rho = 5. One step with slopes
from finite differences is not sufficient: p compensates a shift of the resonance of hundreds of standard deviations.
Features with and without the effect have the same histories and no jitter.

Run: python -m benchmarks.unit_strengths writes transient/virtual_bench/strength.toml.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from transient.virtual_bench.beam import BeamParameters, reduced_beam, stations_at
from transient.virtual_bench.campaign import (
    FORCE_FLOOR,
    HELD_OUT_LEVELS,
    HELD_OUT_REPEATS,
    MOTION_FLOOR,
    NOISE,
    PARAMETER_DEVIATION,
    CampaignPoints,
    Sweep,
    scaled,
    sweeps,
)
from transient.virtual_bench.effect import KINDS, NOTHING, HiddenEffect
from transient.virtual_bench.hidden_effect import STRENGTHS

Vector = Float[NDArray[np.float64], " n"]
Matrix = Float[NDArray[np.float64], "n m"]

#: Calibration parameter of the distances of the stations, which a refit may also change.
BEARING = "bearing"
REFITTED = {**PARAMETER_DEVIATION, BEARING: 0.02}
#: Change of the features by an effect of unit strength [standard deviations].
UNIT = 5.0
#: Change of the features to which the search scales an effect; the unit strength follows in proportion. It is above the
#: norm of about ten of the scatter that remains because sweeps of two similar specimens leave different histories.
AIM = 30.0
#: Number of repeats for the scatter, and fraction a of their variances that is added.
N_SAMPLE = 60
UNSEEN = 0.5
#: Number of histories over which differences are averaged.
N_HISTORY = 4
#: Initial strengths of the search, in SI units.
GUESS = {
    "mass": 3e-4,
    "spring": 3000.0,
    "cubic": 2.5e4,
    "air_damping": 4e-4,
    "gap": 5e-7,
    "preload": 2.0,
    "friction": 0.03,
    "stop": 1000.0,
}
#: Number of steps of a refit.
N_REFIT = 4
#: Fraction of the initial strength at which only the scatter remains.
NEARLY_NOTHING = 1e-4


def training(points: CampaignPoints) -> CampaignPoints:
    """Points of a campaign that are not held out."""
    levels = [level for level in points.levels if level not in HELD_OUT_LEVELS]
    return replace(points, levels=levels, n_repeat=points.n_repeat - len(HELD_OUT_REPEATS))


def features(measured: Sequence[Sweep]) -> Vector:
    """Features of one repeat: means over both sweeps, real and imaginary parts separate, shape (k,)."""
    return np.concatenate([_parts(*_means(sweep)) for sweep in measured])


def noise_variance(measured: Sequence[Sweep], n_repeat: int) -> Vector:
    """Variance by the noise of the readings of the features of the mean over `n_repeat` repeats, shape (k,)."""
    parts = []
    for sweep in measured:
        motion, force = _mean_of_sweeps(sweep.readings.motion), _mean_of_sweeps(sweep.readings.force)
        # Variances of a complex mean over both sweeps and all repeats; half of it in each part.
        first = np.abs(motion[..., 0])
        motion_1 = (NOISE**2 + (MOTION_FLOOR / first) ** 2) / (2 * n_repeat)
        motion_3 = (NOISE * np.abs(motion[..., 1]) / first) ** 2 + (MOTION_FLOOR / first) ** 2
        ratio = motion_3 / (2 * n_repeat) + np.abs(motion[..., 1] / first) ** 2 * motion_1
        relative = np.array([0.0, NOISE, NOISE])
        reading = (relative * np.abs(force)) ** 2 + FORCE_FLOOR**2
        spread = [
            (sweep.level / first) ** 2 * motion_1 / 2,
            ratio / 2,
            reading[..., 0] / (2 * n_repeat),
            reading[..., 1:] / (4 * n_repeat),
        ]
        doubled = [spread[0], spread[0], spread[1], spread[1], spread[2], spread[3], spread[3]]
        parts.append(np.concatenate([item.ravel() for item in doubled]))
    return np.concatenate(parts)


def refitted(change: Callable[[Vector], Vector], slopes: Matrix) -> float:
    """Smallest norm of change(p), shape (k,), in refits from p = 0 with the slopes there, shape (k, m)."""
    p = np.zeros(slopes.shape[1])
    value, slopes = change(p), slopes.copy()
    smallest = float(np.linalg.norm(value))
    for _ in range(N_REFIT):
        step = -np.linalg.lstsq(slopes, value, rcond=None)[0]
        p = p + step
        after = change(p)
        slopes += np.outer(after - value - slopes @ step, step) / (step @ step)
        value = after
        smallest = min(smallest, float(np.linalg.norm(value)))
    return smallest


def unit_strength(kind: str, norm: Callable[[float], float], scatter: float = 0.0) -> float:
    """Strength at which the norm without scatter is `UNIT`, scaled from a norm of about `AIM`."""
    strength = GUESS[kind]
    for attempt in range(5):
        size = float(np.sqrt(max(norm(strength) ** 2 - scatter**2, 1e-6)))
        if 0.4 * AIM < size < 2.5 * AIM or attempt == 4:
            break
        strength *= float(np.clip(AIM / size, 0.1, 10.0))
    return strength * UNIT / size


def find_unit_strengths(report: Callable[[str], None] = lambda _: None) -> dict[str, dict[str, float]]:
    """Unit strength [SI] of all kinds and places."""
    from scipy.linalg import solve_triangular

    nominal, points = BeamParameters(), training(CampaignPoints())
    once, nothing = len(points.levels), HiddenEffect(kind=NOTHING)

    def of_repeats(
        off: Mapping[str, float], effect: HiddenEffect, n_repeat: int, jitter: float, seed: int
    ) -> list[Vector]:
        taken, beam = replace(points, n_repeat=n_repeat), reduced_beam(stations=stations_at(off.get(BEARING, 1.0)))
        parameters = scaled(nominal, **{name: factor for name, factor in off.items() if name != BEARING})
        measured = list(sweeps(beam, parameters, effect, taken, np.random.default_rng(seed), jitter=jitter))
        return [features(measured[at : at + 2 * once]) for at in range(0, len(measured), 2 * once)]

    def mean(off: Mapping[str, float], effect: HiddenEffect) -> Vector:
        return np.asarray(np.mean(of_repeats(off, effect, N_HISTORY, 0.0, 1), axis=0))

    first = list(
        sweeps(reduced_beam(), nominal, nothing, replace(points, n_repeat=1), np.random.default_rng(1), jitter=0.0)
    )
    scatter = np.cov(np.array(of_repeats({}, nothing, N_SAMPLE, 1.0, 2)), rowvar=False)
    scatter += UNSEEN * np.diag(np.diag(scatter))
    covariance = np.diag(noise_variance(first, points.n_repeat)) + scatter / points.n_repeat
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    report(f"{len(root)} features")
    base = mean({}, nothing)

    def whitened(off: Mapping[str, float], effect: HiddenEffect) -> Vector:
        return np.asarray(solve_triangular(root, mean(off, effect) - base, lower=True), dtype=np.float64)

    slopes = []
    for name, deviation in REFITTED.items():
        ends = [whitened({name: 1 + sign * deviation / 4}, nothing) for sign in (1, -1)]
        # Slopes per standard deviation of the parameter, so that Broyden's steps have similar sizes.
        slopes.append((ends[0] - ends[1]) * 2)
        report(f"{name}: {np.linalg.norm(slopes[-1]):.1f} standard deviations")
    matrix = np.column_stack(slopes)

    def norm(kind: str, place: str, strength: float) -> float:
        effect = HiddenEffect(kind=kind, place=place, strength=strength)

        def change(p: Vector) -> Vector:
            pairs = zip(REFITTED.items(), p, strict=True)
            return whitened({name: 1 + sigma * float(item) for (name, sigma), item in pairs}, effect)

        size = refitted(change, matrix)
        report(f"{kind} {place} {strength:.4g}: {size:.2f}")
        return size

    scatters = [norm(kind, KINDS[kind][0], NEARLY_NOTHING * GUESS[kind]) for kind in ("mass", "preload")]
    scatter_norm = float(np.sqrt(np.mean(np.square(scatters))))
    return {
        kind: {place: unit_strength(kind, partial(norm, kind, place), scatter_norm) for place in places}
        for kind, places in KINDS.items()
    }


def write(found: dict[str, dict[str, float]], path: Path) -> None:
    """Write the unit strengths as a TOML table."""
    lines = [
        "# Strength [SI] at which an effect moves the noise-free features of a campaign by 5 standard deviations, the",
        "# calibration parameters refitted. Made by: python -m benchmarks.unit_strengths",
    ]
    for kind, places in found.items():
        lines.append(f"\n[unit_strength.{kind}]")
        lines += [f"{place} = {value:.3g}" for place, value in places.items()]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _mean_of_sweeps(values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    half = len(values) // 2
    return np.asarray((values[:half] + values[half:][::-1]) / 2)


def _means(sweep: Sweep) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128]]:
    return sweep.level, _mean_of_sweeps(sweep.readings.motion), _mean_of_sweeps(sweep.readings.force)


def _parts(level: float, motion: NDArray[np.complex128], force: NDArray[np.complex128]) -> Vector:
    inverse, ratio = level / motion[..., 0], motion[..., 1] / motion[..., 0]
    parts = [inverse.real, inverse.imag, ratio.real, ratio.imag]
    parts += [force[..., 0].real, force[..., 1:].real, force[..., 1:].imag]
    return np.concatenate([part.ravel() for part in parts])


if __name__ == "__main__":
    write(find_unit_strengths(lambda line: print(line, flush=True)), STRENGTHS)
