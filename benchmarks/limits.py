"""Cost and reliability of response limits for a blade with 28 contacts (`damper_model.py`), on one core.

H = 5, 256 samples, 60 frequencies and levels of 1, 3, 5 and 10 N. Measured are the processor time of both limits
without the audit; new random histories against the finished limits; differences between two seeds; and at a few points
two other methods: that of the paper (all harmonics and sliders as unknowns of an interior-point search), and IPOPT with
exact derivatives (`limits_full_space.py`). Run it with

    python benchmarks/limits.py [frequencies histories second-seed(0 or 1) seconds-a-full-space-point]
"""

import os
import sys
import time
from collections import defaultdict

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"  # before numpy reads them

import numpy as np  # noqa: E402
from damper_model import TIP, damper_system, stuck_frequencies  # noqa: E402
from limits_full_space import race  # noqa: E402

from hbsolve.balance import HarmonicBalance  # noqa: E402
from hbsolve.limits.objective import OutputHarmonic  # noqa: E402
from hbsolve.limits.problem import LimitProblem  # noqa: E402
from hbsolve.limits.random_histories import independent_histories  # noqa: E402
from hbsolve.limits.response_limits import limit_problem, response_limits  # noqa: E402
from hbsolve.limits.result import ResponseLimits  # noqa: E402
from hbsolve.limits.search import LimitSettings  # noqa: E402
from hbsolve.limits.task import StageProgress  # noqa: E402

LEVELS = (1.0, 3.0, 5.0, 10.0)
#: Frequency range relative to the first frequency with all contacts stuck: from far below the resonances to above them.
BAND = (0.93, 1.01)


class Clock:
    """Processor time by stage [s]."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self.last, self.stage = time.process_time(), ""

    def __call__(self, progress: StageProgress) -> None:
        now = time.process_time()
        self.spent[self.stage] += now - self.last
        self.last, self.stage = now, progress.stage

    def close(self) -> None:
        self.spent[self.stage] += time.process_time() - self.last


def timed(problem: LimitProblem, omega: np.ndarray, seed: int) -> tuple[ResponseLimits, dict[str, float]]:
    clock = Clock()
    limits = response_limits(problem, omega, LEVELS, settings=LimitSettings(seed=seed), progress=clock)
    clock.close()
    return limits, dict(clock.spent)


def show(limits: ResponseLimits) -> None:
    titles = ("level", "largest upper", "largest lower", "wider than 2 %", "predicted", "realised", "repaired", "jumps")
    print("\n|", " | ".join(titles), "| outside |")
    for level, force in enumerate(limits.level):
        wide = (limits.upper[level] > 1.02 * limits.lower[level]).sum()
        print(
            f"| {force:g} N | {limits.upper[level].max() * 1e6:.2f} um | {limits.lower[level].max() * 1e6:.2f} um "
            f"| {wide} | {limits.predicted[:, level].max():.1e} | {limits.realised[:, level].max():.1e} "
            f"| {limits.repaired[:, level].sum()} | {limits.jump[:, level].sum()} "
            f"| {limits.n_outside[:, level].sum()} of {limits.n_sampled[level].sum()} |"
        )
    print(f"largest residual {np.nanmax(limits.residual_norm):.1e}")


def main() -> None:
    given = [float(text) for text in sys.argv[1:]] + [60, 300, 1, 0][len(sys.argv) - 1 :]
    n_frequency, n_history, second, seconds = int(given[0]), int(given[1]), int(given[2]), given[3]
    system = damper_system(1.0)
    first = stuck_frequencies(system.mass, system.stiffness, list(system.joints))[0]
    balance = HarmonicBalance(system=system, n_harmonic=6, n_sample=256)
    problem = limit_problem(balance, OutputHarmonic(row=TIP))
    print(f"box: {problem.box.reach.max() * 1e6:.2f} um; first frequency, stuck: {first / 2 / np.pi:.2f} Hz")
    # Compile the kernels.
    response_limits(problem, [0.98 * first], [4.0], settings=LimitSettings(sample=2, frequencies=1))
    omega = first * np.linspace(*BAND, n_frequency)
    limits, spent = timed(problem, omega, 0)
    search = sum(spent.values()) - spent["audit"]
    points = limits.lower.size
    print(f"search {search:.1f} s, {search / points:.3f} s a point; audit {spent['audit']:.1f} s; {points} points")
    print(", ".join(f"{stage} {seconds_:.1f} s" for stage, seconds_ in spent.items() if stage))
    show(limits)
    if n_history:
        began = time.process_time()
        fresh = independent_histories(problem, limits, n_history, seed=77)
        result = np.isfinite(fresh.value).sum()
        print(
            f"\n{result} of {fresh.value.size} new states in {time.process_time() - began:.0f} s: outside by 0.1 % "
            f"{fresh.share_outside(1e-3):.3%}, by 0.5 % {fresh.share_outside(5e-3):.3%}, "
            f"worst {np.nanmax(fresh.excess):.2%}"
        )
        for level, force in enumerate(limits.level):
            excess = fresh.excess[level][np.isfinite(fresh.excess[level])]
            print(f"  {force:g} N: {(excess > 1e-3).sum()} of {excess.size} by 0.1 %, {(excess > 5e-3).sum()} by 0.5 %")
    if second:
        other, _ = timed(problem, omega, 1)
        for name, one, two in (("upper", limits.upper, other.upper), ("lower", limits.lower, other.lower)):
            differ = np.abs(two / one - 1)
            print(f"two seeds, {name}: worst {differ.max():.2%}, {(differ > 5e-3).sum()} of {differ.size} above 0.5 %")
    if seconds:
        for level in (2, 1):  # at the frequency where the limits are farthest apart
            race(problem, limits, level, int(np.nanargmax(limits.upper[level] / limits.lower[level])), seconds)


if __name__ == "__main__":
    main()
