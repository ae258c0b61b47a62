"""Responses that no sweep from rest passes: the isola of a Duffing oscillator with a tuned nonlinear absorber."""

from pathlib import Path

import numpy as np

from figure.response_curves import CurveMark, DrawnCurve, ResponseCurves, response_curves_figure
from figure.style import png
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.detached import detached_curves
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.stability.branch_stability import branch_stability
from reduction.jointed_system import CubicSpring, JointedSystem
from transient.state import start_from
from transient.steady import steady_motion

# Detroux, Habib, Masset and Kerschen, Mech. Syst. Signal Process. 60-61 (2015): an absorber of 5 % of the mass.
k, c, cubic = 0.04535, 0.01276, 0.004167  # N/m, N s/m, N/m^3 of the absorber
system = JointedSystem(
    mass=np.diag([1.0, 0.05]),
    damping=[[0.002 + c, -c], [-c, c]],
    stiffness=[[1 + k, -k], [-k, k]],
    joints=[
        CubicSpring(name="ground", direction=np.array([1.0, 0.0]), stiffness=1.0),
        CubicSpring(name="absorber", direction=np.array([1.0, -1.0]), stiffness=cubic),
    ],
    harmonic_force=[[0, 0], [1.0, 0]],
)
first, last = 0.6, 2.8  # rad/s
curves, isolas = [], {}
for level in (0.11, 0.15, 0.19):
    balance = HarmonicBalance(system=system, n_harmonic=6, level=level)
    main = frequency_response(balance, first, last)
    isolas[level] = detached_curves(balance, main, first, last)
    for number, branch in enumerate((main, *isolas[level])):
        stability = branch_stability(balance, branch)
        label = f"{level:g} N" + (f", isola {number}" if number else "")
        marks = [
            CurveMark(label=item.kind.label, parameter=item.state.frequency, response=item.state.coefficients[1, 0])
            for item in stability.bifurcations
        ]
        curves.append(DrawnCurve(label=label, parameter=branch.frequency, response=branch.output(0), group=level,
                                 unstable=~stability.is_stable, marks=marks))  # fmt: skip
        print(f"{label}: {len(branch.frequency)} points, up to {branch.amplitude(0).max():.3f} m, "
              f"{branch.stop_message}")  # fmt: skip

title = "Duffing oscillator with a nonlinear absorber: displacement of the mass"
figure = response_curves_figure(
    ResponseCurves(curves=curves, title=title, parameter_label="frequency [Hz]", amplitude_label="amplitude [m]")
)
Path("isolas.png").write_bytes(png(figure))
print("drawn in isolas.png")

# At 0.11 N there is no isola yet, and at 0.19 N it is part of the curve.
assert [len(item) for item in isolas.values()] == [0, 1, 0]
(isola,) = isolas[0.15]
assert isola.stop_reason is StopReason.ISOLA
# Time integration that begins on its stable side stays there.
balance = HarmonicBalance(system=system, n_harmonic=6, level=0.15)
stable = np.flatnonzero(branch_stability(balance, isola).is_stable)
at = int(stable[isola.amplitude(0)[stable].argmax()])
omega = float(isola.angular_frequency[at])
motion = steady_motion(system, omega, start_from(system, omega, isola.coefficients[at]), 0.15)
assert np.isclose(abs(motion.coefficients(2)[1, 0]), isola.amplitude(0)[at], rtol=1e-3)
