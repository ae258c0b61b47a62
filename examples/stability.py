"""Which responses last: two masses with a hardening spring, their folds, and the backbone through the peaks."""

from pathlib import Path

import numpy as np

from figure.response_curves import CurveMark, DrawnCurve, ResponseCurves, response_curves_figure
from figure.style import png
from hbsolve.backbone.backbone import backbone
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from hbsolve.stability.branch_stability import branch_stability
from reduction.jointed_system import CubicSpring, JointedSystem
from transient.state import start_from
from transient.steady import steady_motion

M = np.diag([1.0, 0.6])  # kg
K = np.array([[3.0e5, -1.2e5], [-1.2e5, 1.6e5]])  # N/m
C = 1.5 * M + 1e-5 * K
spring = CubicSpring(name="hardening", direction=np.array([0.0, 1.0]), stiffness=2e11)  # N/m^3
system = JointedSystem(mass=M, damping=C, stiffness=K, joints=[spring], harmonic_force=[[0, 0], [0, 1.0]])
balance = HarmonicBalance(system=system, n_harmonic=8)

curves = []
for level in (0.4, 1.5, 3.0):
    at_level = balance.at_level(level)
    curve = frequency_response(at_level, 2 * np.pi * 50, 2 * np.pi * 80)
    stability = branch_stability(at_level, curve)
    marks = [
        CurveMark(
            label=point.kind.label, parameter=point.state.frequency, response=1e6 * point.state.coefficients[1, 1]
        )
        for point in stability.bifurcations
    ]
    curves.append(
        DrawnCurve(label=f"{level:g} N", parameter=curve.frequency, response=1e6 * curve.output(1),
                   unstable=~stability.is_stable, marks=marks)
    )  # fmt: skip
    for point in stability.bifurcations:
        print(f"{level:g} N: {point.kind.label} at {point.state.frequency:.3f} Hz, multiplier {point.multiplier:.4f}")

# The nonlinear mode passes the peaks: it is the free motion whose damping is fed in again.
mode = backbone(balance, 1, 1e-6, 3e-3)
reached = slice(int(np.searchsorted(mode.level(system.dynamic[1]), level)) + 1)  # just beyond the highest peak
line = DrawnCurve(label="backbone", parameter=mode.frequency[reached], response=1e6 * mode.coefficients[reached, 1, 1])
title = "Two masses with a hardening spring: displacement of the second"
figure = response_curves_figure(
    ResponseCurves(curves=curves, backbone=line, title=title, parameter_label="frequency [Hz]",
                   amplitude_label="amplitude [µm]")
)  # fmt: skip
Path("stability.png").write_bytes(png(figure))
print("drawn in stability.png")

# At the highest peak the backbone has the amplitude of the curve, to what the second mode adds.
top = int(curve.amplitude(1).argmax())
expected = np.interp(level, mode.level(system.dynamic[1]), mode.displacement(1))
assert np.isclose(curve.amplitude(1)[top], expected, rtol=0.01)
# Time integration stays near a stable point of the curve, and leaves an unstable one at the same frequency.
unstable = int(np.flatnonzero(~stability.is_stable)[len(np.flatnonzero(~stability.is_stable)) // 2])
for index, stays in ((unstable, False), (int(np.flatnonzero(stability.is_stable)[len(curve.frequency) // 4]), True)):
    start = start_from(system, curve.angular_frequency[index], 1.001 * curve.coefficients[index])
    motion = steady_motion(system, curve.angular_frequency[index], start, level)
    assert np.isclose(abs(motion.coefficients(2)[1, 1]), curve.amplitude(1)[index], rtol=0.01) == stays
