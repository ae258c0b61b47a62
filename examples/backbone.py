"""Frequency and damping of a mode against its amplitude: a chain that rubs on a wall, with its forced peaks."""

import numpy as np
from matplotlib.figure import Figure

from hbsolve.backbone.backbone import backbone
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.resonance import resonance_curve
from hbsolve.energy import energy_balance
from reduction.jointed_system import FrictionContact, JointedSystem, along, between

M = np.eye(3)  # kg
K = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])  # N/m
C = 0.2 * M + 1e-5 * K
wall = along(3, {2: 0.2})  # an inclined wall: the motion of the last mass changes the normal load
rub = FrictionContact(name="rub", tangents=between(3, 2), normal=wall, tangential_stiffness=4e3,
                      normal_stiffness=4e4, friction_coefficient=0.4, preload=8.0)  # fmt: skip
system = JointedSystem(mass=M, damping=C, stiffness=K, joints=[rub], static_load=8.0 * wall,
                       harmonic_force=[[0, 0, 0], [1.0, 0, 0]])  # fmt: skip
balance = HarmonicBalance(system=system, n_harmonic=8, n_sample=1024)

mode = backbone(balance, 1, 2e-4, 1.5e-2, step=0.05)
levels = [0.05, 0.2, 0.4, 0.7, 1.0, 1.3, 1.6, 2.0, 2.5]  # N
peaks = resonance_curve(balance, levels, 2, 2 * np.pi * 14, 2 * np.pi * 20)
# What joints and damping take from a forced response in a period, over the energy that it stores.
losses = [energy_balance(balance.at_level(level), peak.state) for level, peak in zip(levels, peaks, strict=True)]

amplitude = mode.displacement(2)
figure = Figure(figsize=(11, 4.4), layout="constrained", dpi=120)
left, middle, right = figure.subplots(1, 3)
left.semilogx(1e3 * amplitude, mode.frequency, label="backbone")
left.semilogx([1e3 * peak.amplitude for peak in peaks], [peak.frequency for peak in peaks], "o", label="forced peaks")
middle.semilogx(1e3 * amplitude, 100 * mode.damping_ratio)
middle.semilogx([1e3 * peak.amplitude for peak in peaks], [50 * loss.loss_factor for loss in losses], "o")
right.loglog(1e3 * amplitude, mode.level(system.dynamic[1]))
right.loglog([1e3 * peak.amplitude for peak in peaks], levels, "o")
for axes, label in ((left, "frequency [Hz]"), (middle, "damping ratio [%]"), (right, "force at resonance [N]")):
    axes.set(xlabel="amplitude of the last mass [mm]", ylabel=label)
    axes.grid(alpha=0.3)
    axes.xaxis.set_minor_formatter("")
    axes.xaxis.set_major_formatter("{x:g}")
left.legend()
figure.savefig("backbone.png")
print("drawn in backbone.png")

for level, peak in zip(levels, peaks, strict=True):
    frequency = np.interp(peak.amplitude, amplitude, mode.frequency)
    damping = np.interp(peak.amplitude, amplitude, mode.damping_ratio)
    print(f"{level:4g} N: {1e3 * peak.amplitude:.4f} mm at {peak.frequency:.3f} Hz; "
          f"backbone {frequency:.3f} Hz, damping ratio {100 * damping:.2f} %")  # fmt: skip
    # A peak of the amplitude lies beside phase resonance, by less than half of its half-power width.
    assert abs(peak.frequency / frequency - 1) < max(damping, 1e-3)
