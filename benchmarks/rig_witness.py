"""Compare steady states of the rig by harmonic balance with time integration, and measure the cost of a curve.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_witness [CASE]

Compared is each level of the case with each of its friction histories, at the frequency of largest motion of the tip.
Time integration starts on the orbit from harmonic balance and continues until the motion is periodic; it would leave a
wrong orbit. Because sticking sliders keep their positions, harmonic balance is then solved again with the sliders of
the integration, with more harmonics until the amplitude of the tip changes by less than `CONVERGED`.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.rig_case import PreparedRig, prepared
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.steady_state import steady_state
from study.kind.registry import open_case
from study.shipped_cases import RIG
from study.solve.curve import RequestedCurve, response_curve
from transient.state import start_from
from transient.steady import steady_motion

#: Largest relative change of the fundamental by the last doubling of the harmonics, a tenth of the required accuracy;
#: largest number of harmonics.
CONVERGED, MOST_H = 1e-3, 40
SAMPLES = 512
#: Time steps per period. The errors at 2.5 mm, 1 N and 253.8 Hz: 0.7 % with 512, 0.13 % with 1024, 0.02 % with 2048.
STEPS = 2048


def solved(rig: PreparedRig, curve: RequestedCurve) -> tuple[ResponseBranch, float]:
    """Compute a curve; returns it and its processor time [s]."""
    model, start = rig.model, time.process_time()
    branch = response_curve(model.system, curve, model.harmonics, model.n_sample)
    return branch, time.process_time() - start


def cost(path: Path) -> None:
    """Print the processor time of 100 points on one core."""
    print("\n| friction | points | s a 100 points |\n|---|---|---|")
    for tangents in ("along", "both"):
        rig = prepared(open_case(path), contact={"tangents": tangents})
        curves = rig.model.curves
        solved(rig, curves[-1])  # compilation
        n_point, seconds = 0, 0.0
        for curve in (curves[0], curves[-1]):
            branch, spent = solved(rig, curve)
            n_point, seconds = n_point + len(branch.frequency), seconds + spent
        print(f"| {tangents} | {n_point} | {100 * seconds / n_point:.1f} |", flush=True)


def compare(path: Path) -> None:
    """Print one line for each level and history."""
    rig = prepared(open_case(path), contact={"tangents": "along"})
    model = rig.model
    tip = model.outputs[0].row
    print("\n| curve | frequency [Hz] | H | harmonic balance [um] | time integration [um] | apart | periods |")
    print("|---|---|---|---|---|---|---|")
    for curve in model.curves:
        branch, _ = solved(rig, curve)
        peak = int(np.abs(branch.coefficients[:, 1] @ tip).argmax())
        omega = float(branch.angular_frequency[peak])
        balance = HarmonicBalance(
            system=model.system, n_harmonic=model.harmonics + 1, n_sample=model.n_sample, level=curve.fixed
        )
        state = steady_state(balance, omega, start=branch.start(balance, peak), slider=curve.slider)
        motion = steady_motion(
            model.system, omega, start_from(model.system, omega, state.coefficients, state.periodic_slider),
            curve.fixed, tolerance=1e-4, steps_per_period=STEPS, max_steps_per_period=STEPS, acceleration=4,
        )  # fmt: skip
        if not motion.periodic:
            print(f"| {curve.label} | {omega / 2 / np.pi:.3f} | {motion.message} |", flush=True)
            continue
        mine, n_harmonic = converged(balance, omega, motion.start.slider, tip)
        theirs = motion.coefficients(2)[1] @ tip
        print(
            f"| {curve.label} | {omega / 2 / np.pi:.3f} | {n_harmonic} | {1e6 * abs(mine):.3f} | "
            f"{1e6 * abs(theirs):.3f} | {abs(mine - theirs) / abs(theirs):.1e} | {motion.n_period} |",
            flush=True,
        )


def converged(
    balance: HarmonicBalance, omega: float, slider: NDArray[np.float64], tip: NDArray[np.float64]
) -> tuple[complex, int]:
    """Fundamental of the tip after convergence with the number of harmonics, and this number."""
    before, n = None, balance.n_harmonic - 1
    while True:
        finer = replace(balance, n_harmonic=n + 1, n_sample=max(SAMPLES, 16 * n))
        result = complex(steady_state(finer, omega, slider=slider).coefficients[1] @ tip)
        if (before is not None and abs(result - before) < CONVERGED * abs(result)) or 2 * n > MOST_H:
            return result, n
        before, n = result, 2 * n


if __name__ == "__main__":
    chosen = Path(sys.argv[1]) if len(sys.argv) > 1 else RIG
    cost(chosen)
    compare(chosen)
