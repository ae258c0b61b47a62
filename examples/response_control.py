"""What a test under response control measures: the force over frequency and amplitude, and the response on it."""

from pathlib import Path

import numpy as np

from figure.force_surface import ForceCurve, ForceSurface, force_surface_figure
from figure.style import png
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.controlled_response import controlled_response
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.response_surface import response_surface
from reduction.jointed_system import CubicSpring, JenkinsElement, JointedSystem

# A mass of 1 kg at 50 Hz with 1 % damping, a hardening spring, and a slider that yields at 0.1 mm.
stiffness = (2 * np.pi * 50) ** 2
one = np.ones(1)
system = JointedSystem(
    mass=[[1.0]],
    damping=[[2 * 0.01 * 2 * np.pi * 50]],
    stiffness=[[stiffness]],
    joints=[
        CubicSpring(name="spring", direction=one, stiffness=0.3 * stiffness / 1e-3**2),
        JenkinsElement(
            name="slider", direction=one, tangential_stiffness=0.1 * stiffness, limit_force=0.1 * stiffness * 1e-4
        ),
    ],
    harmonic_force=[[0.0], [1.0]],  # 1 N at level 1
)
balance = HarmonicBalance(system=system, n_harmonic=4)

frequency, amplitude = np.linspace(45, 62, 69), np.geomspace(2e-5, 1.5e-3, 25)  # Hz, m
surface = response_surface(balance, 0, 2 * np.pi * frequency, amplitude)
curves = []
for force in (0.7, 1.5, 3.0, 6.0):
    pieces = [(piece.angular_frequency / (2 * np.pi), 1e6 * piece.amplitude) for piece in surface.at_level(force)]
    curves.append(ForceCurve(label=f"{force:g} N", pieces=pieces))
    print(f"{force:g} N: up to {max(a.max() for _, a in pieces):.0f} um")

title = "An oscillator with a hardening spring and a slider under response control"
figure = force_surface_figure(
    ForceSurface(title=title, subtitle="curves: response to a constant force, also where it is unstable",
                 frequency=frequency, amplitude=1e6 * amplitude, force=surface.level,
                 amplitude_label="amplitude of the displacement [\u00b5m]", force_label="amplitude of the force [N]",
                 curves=curves)
)  # fmt: skip
Path("force_surface.png").write_bytes(png(figure))
print("drawn in force_surface.png")

# Under 3 N the response has two folds; with 0.6 mm held the curve passes through.
swept = frequency_response(balance.at_level(3.0), 2 * np.pi * 45, 2 * np.pi * 62)
assert (np.diff(swept.angular_frequency) < 0).any()
held = controlled_response(balance, 0, 6e-4, 2 * np.pi * 45, 2 * np.pi * 62)
assert (np.diff(held.angular_frequency) > 0).all()
# The peak of the sweep is that of the contour.
assert np.isclose(1e6 * swept.amplitude(0).max(), max(a.max() for _, a in curves[2].pieces), rtol=1e-2)
