"""Limits at one frequency are those of a curve: the search looks at the resonance beside it as well."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from hbsolve.balance import HarmonicBalance
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from study.case.setup import read_case
from study.shipped_cases import LIMITS
from study.solve.model import make_solve_model

LEVEL = 1.0
SETTINGS = LimitSettings(population=8, sample=0)
#: Only the frequency that was asked for, as if nothing lay beside it.
ALONE = replace(SETTINGS, frequencies=1)

system = make_solve_model(read_case(LIMITS)).system
balance = HarmonicBalance(system=system, n_harmonic=4, n_sample=64)
problem = limit_problem(balance, OutputHarmonic(row=0))

frequency = np.linspace(253, 301, 49)
curve = response_limits(problem, 2 * np.pi * frequency, [LEVEL], settings=SETTINGS)
single = {}
for at in range(4, 45, 4):
    omega = [2 * np.pi * frequency[at]]
    single[at] = [
        response_limits(problem, omega, [LEVEL], settings=chosen).value[:, 0, 0] for chosen in (SETTINGS, ALONE)
    ]

figure = Figure(figsize=(8, 4.6), layout="constrained", dpi=120)
axes = figure.subplots()
axes.fill_between(frequency, *(1e6 * curve.value[:, 0]), color="tab:blue", alpha=0.2, label="curve, 49 frequencies")
places = frequency[list(single)]
limits, alone = (1e6 * np.array([item[number] for item in single.values()]).T for number in (0, 1))
axes.plot(places, limits.T, "o", color="tab:blue", markerfacecolor="white", label=["one frequency", None])
axes.plot(places, alone.T, "x", color="tab:red", label=["without its neighbours", None])
axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the blade [µm]", title=f"Wedge damper, level {LEVEL:g}")
axes.legend()
figure.savefig("single_frequency_limits.png")
print("drawn in single_frequency_limits.png")

for at, (value, blind) in single.items():
    (lower, upper), reference = value, curve.value[:, 0, at]
    print(f"{frequency[at]:.0f} Hz: {1e6 * lower:8.3f} to {1e6 * upper:8.3f} um; without neighbours "
          f"{1e6 * blind[0]:8.3f} to {1e6 * blind[1]:8.3f} um")  # fmt: skip
    # Steady states of 64 samples jump a little at kinks; the search does not miss what the curve has.
    assert upper > (1 - 1e-3) * reference[1]
    assert lower < (1 + 1e-3) * reference[0]
