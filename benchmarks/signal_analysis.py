"""Accuracy of stiffness and friction from loops, of modes from frequency responses, and of ring-downs, with noise.

    python -m benchmarks.signal_analysis [loops] [modes] [decays] [--seeds N]

Every system is random with a known truth: loops are Jenkins elements in parallel, responses a sum of three close modes,
decays an oscillator with a cubic spring or with one Jenkins element, whose backbones have closed forms. No constant was
set with these seeds.
"""

import sys
import time

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from correlation.errors import CampaignError
from correlation.modal.assurance import compute_modal_assurance
from correlation.modal.fit_modes import fit_modes
from correlation.signal.ring_down import analyse_ring_down
from correlation.signal.stick_slip import estimate_stick_slip
from reduction.jointed_system import JenkinsElement, JointedSystem
from transient.integrate import integrate
from transient.state import TransientState

Array = NDArray[np.float64]
FIRST = {"loops": 410_000, "modes": 420_000, "decays": 430_000}
LINES = np.arange(90.0, 115.0, 0.05)
#: Noise of the frequency responses [-], and whether it is proportional to the response at each line.
MODAL_NOISE = ((0.01, False), (0.001, True), (0.005, True), (0.02, True))
#: Noise of the decays relative to the initial amplitude [-].
DECAY_NOISE = (0.001, 0.01)


def rub(place: Array, stiffness: Array, limit: Array) -> Array:
    """Force of parallel Jenkins elements along a displacement; limits of shape (n, j)."""
    slider, forces = np.zeros(len(stiffness)), np.zeros(len(place))
    for i, x in enumerate(place):
        force = np.clip(stiffness * (x - slider), -limit[i], limit[i])
        slider = x - force / stiffness
        forces[i] = force.sum()
    return forces


def loop_hits(seed: int, n_element: int) -> tuple[bool, bool]:
    """Whether stiffness and friction coefficient of a random contact lie in their 95 % intervals."""
    random = np.random.default_rng(seed)
    total, normal = 10 ** random.uniform(5, 8), 10 ** random.uniform(0, 3)
    slip = 10 ** random.uniform(-7, -5) * random.uniform(0.05, 1, n_element)
    stiffness = total * random.dirichlet(np.full(n_element, 2.0)) if n_element > 1 else np.array([total])
    amplitude = slip.max() * random.uniform(1.5, 6)
    samples, n_period = int(random.integers(60, 1500)), int(random.integers(3, 30))
    turn = np.arange((n_period + 1) * samples) / samples
    x = amplitude * np.clip(turn, 0, 1) * np.cos(2 * np.pi * turn + random.uniform(0, 6))
    load = np.full(len(turn), normal)
    if random.uniform() < 0.5:
        load *= 1 + random.uniform(0, 0.6) * np.cos(2 * np.pi * turn * random.integers(1, 3) + random.uniform(0, 6))
    force = rub(x, stiffness, stiffness * slip * load[:, None] / normal)
    noise = 10 ** random.uniform(-4, -1.7, 2)
    offset = 0.3 * np.abs(force).max() * random.standard_normal() * (random.uniform() < 0.5)
    result = estimate_stick_slip(
        x + noise[0] * amplitude * random.standard_normal(len(x)),
        force + noise[1] * np.abs(force).max() * random.standard_normal(len(x)) + offset,
        load * (1 + noise[1] * random.standard_normal(len(x))),
    )
    friction = result.friction_coefficient
    assert friction is not None
    kt, mu = result.tangential_stiffness.interval, friction.interval
    return kt[0] <= total <= kt[1], mu[0] <= float(stiffness @ slip) / normal <= mu[1]


def fit_close_modes(seed: int, share: float, grows: bool) -> tuple[int, tuple[float, float, float] | None]:
    """Fit three close modes; returns the number of modes found and the errors.

    Parameters
    ----------
    seed
        Seed of system and noise.
    share
        Noise relative to the largest value of each response, or to the response at each line [-].
    grows
        Whether the noise is proportional to the response at each line.

    Returns
    -------
    Number of modes, and if it is three the largest relative errors of frequency and damping and the smallest MAC.
    """
    random = np.random.default_rng(seed)
    own = np.array([100.0, 102.0, 105.0]) * (1 + 1e-3 * random.standard_normal(3))
    damping = random.uniform(0.005, 0.01, 3)
    shapes = random.standard_normal((6, 3))
    shapes[0] = random.choice([-1, 1], 3) * random.uniform(0.3, 1.0, 3)
    omega = 2 * np.pi * LINES[:, None]
    receptance = 1 / ((2 * np.pi * own) ** 2 - omega**2 + 2j * damping * 2 * np.pi * own * omega)
    values = -(shapes * shapes[0]) @ receptance.T * omega[:, 0] ** 2
    of = np.abs(values) if grows else np.abs(values).max(axis=1, keepdims=True)
    size = share * of / np.sqrt(2)
    values = values + size * (random.standard_normal(values.shape) + 1j * random.standard_normal(values.shape))
    try:
        result = fit_modes(LINES, values)
    except CampaignError:
        return 0, None
    if len(result.frequency) != 3:
        return len(result.frequency), None
    return 3, (
        float(np.abs(result.frequency / own - 1).max()),
        float(np.abs(result.damping_ratio / damping - 1).max()),
        float(np.diag(compute_modal_assurance(shapes, result.shapes)).min()),
    )


def score_modes(count: int) -> None:
    """Print how often three close modes and spurious modes (ghosts) are found, with each kind of noise."""
    for share, grows in MODAL_NOISE:
        number, errors = zip(
            *(fit_close_modes(FIRST["modes"] + seed, share, grows) for seed in range(count)), strict=True
        )
        good = np.array([row for row in errors if row is not None]).reshape(-1, 3)
        right = ((good[:, 0] < 2e-4) & (good[:, 1] < 0.05) & (good[:, 2] > 0.99)).sum()
        kind = "of the response" if grows else "of its largest"
        print(
            f"modes, noise {100 * share:g} % {kind}: three in {len(good)}, targets in {right}, too few in "
            f"{(np.array(number) < 3).sum()}, ghosts in {(np.array(number) > 3).sum()} of {count}"
        )
        if len(good):
            print(f"    worst frequency, damping, MAC: {good[:, 0].max():.1e}, {good[:, 1].max():.1e}, "
                  f"{good[:, 2].min():.4f}")  # fmt: skip


def decay_errors(seed: int, law: str) -> Array:
    """Largest relative errors of frequency and damping between 7 and 75 % of the initial amplitude, shape (n, 2).

    With friction only above 1.5 times the onset of slip: below, damping changes by a factor within a few periods.
    """
    random = np.random.default_rng(seed)
    damping, own = random.uniform(0.002, 0.008), 2 * np.pi * 100.0
    places = np.geomspace(0.07, 0.75, 10)
    if law == "cubic":
        cubic = random.uniform(0.02, 0.2)
        at = np.arange(8000) / 4000.0
        x = solve_ivp(
            lambda _, y: [y[1], -2 * damping * own * y[1] - own**2 * (y[0] + cubic * y[0] ** 3)],
            (0, at[-1]), [1.0, 0.0], t_eval=at, rtol=1e-9, atol=1e-12,
        ).y[0]  # fmt: skip
        backbone = 100.0 * np.sqrt(1 + 0.75 * cubic * places**2)
        ratio = damping * 100.0 / backbone
    else:
        stiffness, slip = random.uniform(0.01, 0.05), random.uniform(0.05, 0.15)
        system = JointedSystem(
            mass=np.eye(1), damping=np.array([[2 * damping * own]]), stiffness=np.array([[own**2]]),
            joints=[
                JenkinsElement(
                    name="friction", direction=np.ones(1), tangential_stiffness=stiffness * own**2,
                    limit_force=stiffness * own**2 * slip,
                )
            ],
        )  # fmt: skip
        start = TransientState(displacement=np.ones(1), velocity=np.zeros(1), slider=np.zeros(1))
        motion = integrate(system, own, 200, 80, start, 0.0, outputs={"x": np.ones(1)})
        at, x = motion.time, motion.output_displacement["x"]
        places = places[places > 1.5 * slip]
        angle = np.arccos(1 - 2 * slip / places)
        secant = stiffness * (angle - np.sin(2 * angle) / 2) / np.pi
        backbone = 100.0 * np.sqrt(1 + secant)
        work = 4 * stiffness * slip * (places - slip)
        ratio = damping * 100.0 / backbone + work / (2 * np.pi * (1 + secant) * places**2)
    errors, unit = [], random.standard_normal(len(x))
    for noise in DECAY_NOISE:
        mode = analyse_ring_down(at, x + noise * unit)[0]
        order = np.argsort(mode.displacement)
        frequency, result = (
            np.interp(places, mode.displacement[order], part[order]) for part in (mode.frequency, mode.damping_ratio)
        )
        errors.append([np.abs(frequency / backbone - 1).max(), np.abs(result / ratio - 1).max()])
    return np.array(errors)


def main() -> None:
    words = sys.argv[1:]
    count = int(words[words.index("--seeds") + 1]) if "--seeds" in words else 100
    chosen = [name for name in FIRST if name in words] or list(FIRST)
    started = time.process_time()
    if "loops" in chosen:
        for n_element in (1, 12):
            hits = np.array([loop_hits(FIRST["loops"] + seed, n_element) for seed in range(count)]).sum(axis=0)
            print(f"loops, elements {n_element}: kt in its interval in {hits[0]}, mu in {hits[1]} of {count}")
    if "modes" in chosen:
        score_modes(count)
    if "decays" in chosen:
        for law in ("cubic", "friction"):
            errors = np.array([decay_errors(FIRST["decays"] + seed, law) for seed in range(count)])
            for noise, own in zip(DECAY_NOISE, errors.swapaxes(0, 1), strict=True):
                near = (own < [1e-3, 0.05]).sum(axis=0)
                middle = np.median(own, axis=0)
                print(
                    f"decays, {law}, noise {100 * noise:g} %: frequency within 0.1 % in {near[0]}, "
                    f"damping within 5 % in {near[1]} of {count}; "
                    f"medians of the largest errors {middle[0]:.1e}, {middle[1]:.1e}"
                )
    print(f"{time.process_time() - started:.0f} s of processor time")


if __name__ == "__main__":
    main()
