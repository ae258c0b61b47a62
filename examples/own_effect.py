"""An effect of your own from a short file (effects/): in the catalogue, its response, and a check."""

from pathlib import Path

import numpy as np

from correlation.model import Dof, Model, Sensor
from diagnosis.candidate.catalogue import list_effects
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import JointedSystem, along

M = np.diag([1.0, 0.5])
K = np.array([[5e4, -2e4], [-2e4, 2e4]])
C = 2e-5 * K
force = np.array([[0.0, 0.0], [1.0, 0.0]])  # 1 N cos(Omega t) on the first mass
system = JointedSystem(mass=M, damping=C, stiffness=K, harmonic_force=force)
tip = along(2, {1: 1.0})
bench = Model(
    system=system,
    sensors=(Sensor(name="tip", row=tip),),
    dofs=(Dof(node=0, direction="z"), Dof(node=1, direction="z")),
    places={"exciter z": along(2, {0: 1.0}), "tip z": tip},
)

catalogue = list_effects(bench, extra=[Path(__file__).parent / "effects" / "exciter_third_harmonic.py"], level=10.0)
for effect in catalogue.candidates:
    strength = effect.parameters[0]
    print(f"{effect.name:32} {strength.typical:9.3g} {strength.unit:9} {effect.physics}")
for left in catalogue.untestable:
    print(f"{left.name:32} cannot be tested: {left.reason}")

# At a third of the first resonance this effect has its largest response. The structure is linear: the third harmonic
# of the tip is the receptance at three times the frequency, times the third harmonic of the force.
third, share, level = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(M, K)).min()) / 3, 0.05, 10.0
distorted = catalogue.effect("third harmonic of the exciter").apply(bench, [share])
state = steady_state(HarmonicBalance(system=distorted.system, n_harmonic=4, level=level), third)
receptance = np.linalg.inv(K + 3j * third * C - (3 * third) ** 2 * M)
assert np.isclose(tip @ state.coefficients[3], share * level * receptance[1, 0], rtol=1e-9)
print(f"third harmonic of the tip at {third / (2 * np.pi):.2f} Hz: {abs(tip @ state.coefficients[3]) * 1e3:.3f} mm")
