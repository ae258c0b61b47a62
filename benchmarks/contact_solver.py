"""Cost of the contact solver for a blade with 28 contacts: H = 5, 256 samples, 616 unknowns (`damper_model.py`).

Measured on one core are the processor time of a residual, of a residual with its Jacobian against 616 forward
differences (which also check the Jacobian), of one compiled Newton iteration and of a forced-response curve with 100
points, and the memory added by all of these. Run it with

    python benchmarks/contact_solver.py [force in N ...]
"""

import os
import resource
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"  # before numpy reads them

import numpy as np  # noqa: E402
from damper_model import TIP, damper_system, stuck_frequencies  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from processor_time import processor_time  # noqa: E402

from hbsolve.balance import HarmonicBalance  # noqa: E402
from hbsolve.condensed import Condensed  # noqa: E402
from hbsolve.errors import NoSteadyState  # noqa: E402
from hbsolve.joint_law.registry import FORCE, JACOBIAN  # noqa: E402
from hbsolve.newton import BalancePoint, newton  # noqa: E402
from hbsolve.solution import MAX_ITERATION, TOLERANCE, forces_at, residual  # noqa: E402
from hbsolve.state import SteadyState  # noqa: E402
from hbsolve.steady_state import steady_state  # noqa: E402

N_HARMONIC, N_SAMPLE, N_POINT = 6, 256, 100


def forward_differences(balance: HarmonicBalance, condensed: Condensed, state: SteadyState) -> NDArray[np.float64]:
    """dR/dx column by column, shape (616, 616)."""
    x, omega = state.motion, state.angular_frequency
    step = 1e-6 * np.abs(x).max()
    base = residual(balance, condensed, x, forces_at(balance, omega, x, state.sliders, FORCE)).ravel()
    columns = []
    for unknown in range(x.size):
        moved = x.copy()
        moved.flat[unknown] += step
        changed = residual(balance, condensed, moved, forces_at(balance, omega, moved, state.sliders, FORCE)).ravel()
        columns.append((changed - base) / step)
    return np.array(columns).T


def analytic(balance: HarmonicBalance, condensed: Condensed, state: SteadyState) -> NDArray[np.float64]:
    """dR/dx = 1 + A dg/dx from the Jacobian of the joints, shape (616, 616)."""
    x = state.motion
    d, nh = x.shape
    jacobian = forces_at(balance, state.angular_frequency, x, state.sliders, JACOBIAN).jacobian
    first, count = balance.joint_of_direction
    by_motion = np.zeros((d, nh, d, nh))
    for direction in range(d):
        for other in range(count[direction]):
            block = jacobian[direction, :, other * nh : (other + 1) * nh]
            by_motion[direction, :, first[direction] + other] = block
    linear = balance.linear(condensed)
    columns = []
    for column in by_motion.reshape(d, nh, -1).transpose(2, 0, 1):
        forces = forces_at(balance, state.angular_frequency, x, state.sliders, FORCE)._replace(coefficients=column)
        columns.append((residual(balance, condensed, x, forces) - x + linear).ravel())
    return np.eye(x.size) + np.array(columns).T


def measure(force: float) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    system = damper_system(force)
    balance = HarmonicBalance(system=system, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
    first_mode = stuck_frequencies(system.mass, system.stiffness, list(system.joints))[0]  # type: ignore[arg-type]
    omega = np.linspace(0.8, 1.1, N_POINT) * first_mode
    start = time.process_time()
    steady_state(balance, 0.8 * first_mode)
    compiled = time.process_time() - start

    start = time.process_time()
    states: list[SteadyState] = []
    failed = 0
    for w in omega:
        try:
            states.append(steady_state(balance, w, start=states[-1] if states else None))
        except NoSteadyState:
            failed += 1
    curve = time.process_time() - start
    peak = max(states, key=lambda state: state.amplitude(TIP))
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024

    condensed, x = balance.at(peak.angular_frequency), peak.motion

    def evaluate(want: int) -> object:
        return residual(balance, condensed, x, forces_at(balance, peak.angular_frequency, x, peak.sliders, want))

    active = int(forces_at(balance, peak.angular_frequency, x, peak.sliders, JACOBIAN).active.sum())
    one, both = processor_time(lambda: evaluate(FORCE), 20), processor_time(lambda: evaluate(JACOBIAN), 20)
    start = time.process_time()
    differences = forward_differences(balance, condensed, peak)
    by_differences = time.process_time() - start
    exact = analytic(balance, condensed, peak)

    linear = balance.linear(condensed)
    point = BalancePoint(linear, condensed.angular_frequency, condensed.columns, balance.arrays)

    # Start at the previous point, as along the curve.
    neighbour = states[max(states.index(peak) - 1, 0)].motion

    def solve() -> int:
        _, _, iterations = newton(
            neighbour, point, peak.sliders, TOLERANCE * float(np.linalg.norm(linear)), MAX_ITERATION
        )
        return int(iterations)

    iterations = max(solve(), 1)
    # Each call also evaluates the start.
    iteration = (processor_time(solve, 5) - both) / iterations

    print(f"\n{system.n_dof} degrees of freedom, {len(system.joints)} contacts, {x.size} unknowns, {force:g} N\n")
    print("| what | time |\n|---|---|")
    print(f"| residual | {1e3 * one:.3f} ms |")
    print(f"| residual and Jacobian of all joints | {1e3 * both:.3f} ms |")
    print(f"| {x.size} forward differences | {1e3 * by_differences:.0f} ms |")
    print(f"| Newton iteration, mean of {iterations} | {1e3 * iteration:.3f} ms |")
    print(
        f"| condensing at a frequency | {1e3 * processor_time(lambda: balance.at(peak.angular_frequency), 5):.2f} ms |"
    )
    print(f"| curve, {N_POINT} points | {curve:.2f} s |")
    print(f"| first solve, kernels from their cache | {compiled:.2f} s |")
    print(f"\nforward differences against residual and Jacobian: {by_differences / both:.0f}")
    print(f"against what the Jacobian adds: {by_differences / (both - one):.0f}")
    print(f"largest difference between the two: {np.abs(exact - differences).max() / np.abs(exact).max():.1e}")
    iterations_a_point = np.mean([state.iterations for state in states])
    print(f"curve: {failed} points failed, {iterations_a_point:.1f} iterations a point, memory added {memory:.0f} MB")
    print(f"at the peak {active} of {x.size} rows of the joints' Jacobian are not zero: the unknowns of a Newton step")
    print(f"peak {peak.amplitude(TIP):.3e} m at {peak.frequency:.1f} Hz")


def main() -> None:
    for force in [float(text) for text in sys.argv[1:]] or [1.0, 5.0, 20.0]:
        measure(force)


if __name__ == "__main__":
    main()
