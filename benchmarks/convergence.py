"""Convergence with harmonics and samples: error of the fundamental amplitude against H = 41 with 4096 samples.

Three systems at resonance: a slider, a wedge in which the normal load varies until the contact lifts off, and a stop
beside a contact that slides in a plane. Harmonics are varied at 4096 samples; samples are varied at H = 7, against 4096
samples. Prints and draws both tables. Run it with

    python benchmarks/convergence.py [convergence.png]
"""

import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    along,
    between,
)

REFERENCE = (41, 4096)
HARMONICS = (1, 3, 5, 7, 9, 13, 17, 21, 31)
SAMPLES = (32, 64, 128, 256, 512, 1024, 2048)
#: H while the number of samples is varied; small enough for the smallest number of samples.
SAMPLED_HARMONIC = 7
ANGLE = np.deg2rad(30)


def oscillators(joints: list[Joint], force: float) -> JointedSystem:
    """Two masses of 1 kg in x and y (x1, y1, x2, y2), on springs to the ground, with 5e5 N/m between them in x.

    The springs to the ground have 1e6 N/m in x and 1.2e6 N/m in y.
    """
    stiffness = np.diag([1.5e6, 1.2e6, 1.5e6, 1.2e6])
    stiffness[0, 2] = stiffness[2, 0] = -5e5
    load = np.zeros((2, 4))
    load[1] = force * np.array([1.0, 0.3, 0.0, 0.0])
    return JointedSystem(
        mass=np.eye(4), damping=5e-6 * stiffness, stiffness=stiffness, joints=joints, harmonic_force=load
    )


def systems() -> dict[str, JointedSystem]:
    slider = JenkinsElement(name="slider", direction=between(4, 0), tangential_stiffness=4e5, limit_force=20.0)
    wedge = FrictionContact(
        name="wedge",
        normal=along(4, {0: np.sin(ANGLE), 1: np.cos(ANGLE)}),
        tangents=along(4, {0: np.cos(ANGLE), 1: -np.sin(ANGLE)}),
        normal_stiffness=6e5,
        tangential_stiffness=4e5,
        friction_coefficient=0.4,
        preload=25.0,
    )
    stop = ElasticStop(name="stop", direction=between(4, 2), stiffness=1e6, gap=1e-4)
    plane = FrictionContact(
        name="plane",
        normal=along(4, {2: 0.3, 3: 0.2}),
        tangents=np.array([between(4, 0), between(4, 1)]),
        normal_stiffness=6e5,
        tangential_stiffness=4e5,
        friction_coefficient=0.4,
        preload=60.0,
        friction=Friction.COULOMB,
    )
    return {
        "slider": oscillators([slider], 20.0),
        "wedge with lift-off": oscillators([wedge], 20.0),
        "stop and contact in the plane": oscillators([stop, plane], 20.0),
    }


def solve(
    system: JointedSystem, omega: float, n_harmonic: int, n_sample: int, start: SteadyState | None
) -> SteadyState:
    balance = HarmonicBalance(system=system, n_harmonic=n_harmonic + 1, n_sample=n_sample)
    if start is None:
        return steady_state(balance, omega)
    motion = np.zeros((balance.n_direction, 2 * n_harmonic + 1))
    shared = min(motion.shape[1], start.motion.shape[1])
    motion[:, :shared] = start.motion[:, :shared]
    return steady_state(balance, omega, start=motion)


def resonance(system: JointedSystem) -> SteadyState:
    """Steady state of largest amplitude at rising frequencies of a fine grid; H = 9. Unconverged points are skipped."""
    states: list[SteadyState] = []
    balance = HarmonicBalance(system=system, n_harmonic=10, n_sample=512)
    for omega in np.linspace(900.0, 1300.0, 201):
        with suppress(NoSteadyState):
            states.append(steady_state(balance, omega, start=states[-1] if states else None))
    return max(states, key=lambda state: state.amplitude(0))


def errors(system: JointedSystem) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative errors for `HARMONICS` and for `SAMPLES`."""
    peak = resonance(system)
    omega = peak.angular_frequency
    reference = solve(system, omega, *REFERENCE, peak)
    exact = reference.amplitude(0)
    by_harmonic = [
        abs(solve(system, omega, count, REFERENCE[1], reference).amplitude(0) / exact - 1) for count in HARMONICS
    ]
    # Reference with the same harmonics and the most samples, which excludes the truncation error.
    finest = solve(system, omega, SAMPLED_HARMONIC, REFERENCE[1], reference).amplitude(0)
    by_sample = [
        abs(solve(system, omega, SAMPLED_HARMONIC, count, reference).amplitude(0) / finest - 1) for count in SAMPLES
    ]
    print(f"peak at {peak.frequency:.1f} Hz, {exact:.4e} m", end="; ")
    return np.array(by_harmonic), np.array(by_sample)


def draw(results: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
    for name, series in results.items():
        for axis, count, error in zip(axes, (HARMONICS, SAMPLES), series, strict=True):
            axis.loglog(count, np.maximum(error, 1e-12), "o-", markersize=4, label=name)
    for axis, count, label in zip(
        axes, (HARMONICS, SAMPLES), ("harmonics H", "samples per period, H = 7"), strict=True
    ):
        axis.set_xticks(count, [str(n) for n in count])
        axis.minorticks_off()
        axis.set_xlabel(label)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("relative error of the fundamental [-]")
    axes[1].legend(frameon=False)
    figure.savefig(path, dpi=150)


def main() -> None:
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "convergence.png")
    results = {}
    for name, system in systems().items():
        results[name] = errors(system)
        print(name)
    for axis, counts in enumerate((HARMONICS, SAMPLES)):
        print("\n| | " + " | ".join(f"{('H = ', '')[axis]}{count}" for count in counts) + " |")
        print("|---" * (len(counts) + 1) + "|")
        for name, series in results.items():
            print(f"| {name} | " + " | ".join(f"{error:.0e}" for error in series[axis]) + " |")
    draw(results, path)
    print(f"\n{path}")


if __name__ == "__main__":
    main()
