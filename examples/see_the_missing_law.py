"""See a force that no catalogue has: a chain hits stops; the recovered law as a figure and as an effect file.

python examples/see_the_missing_law.py [FOLDER]     # writes missing_law.png and recovered_law.py to FOLDER
"""

import sys
from pathlib import Path

import numpy as np

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import list_effects
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.arrangement import arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.missing_law.curves import compute_curves
from diagnosis.missing_law.description import describe
from diagnosis.missing_law.effect_file import write_effect_file
from diagnosis.missing_law.recover import recover_law
from figure.missing_law import draw_missing_law
from figure.style import png
from reduction.jointed_system import ElasticStop, JointedSystem
from study.diagnose.law_drawing import make_law_drawing
from study.diagnose.missing_law import RecoveredLaw
from transient.virtual_bench.sweep import VirtualSweepTest

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
K = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
places = {f"mass {number + 1}": np.eye(3)[number] for number in range(3)}
force = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
system = JointedSystem(mass=1.2 * np.eye(3), damping=2.5e-4 * K, stiffness=K, harmonic_force=force)
sensors = tuple(Sensor(name=name, row=row) for name, row in places.items())
model = Model(system=system, places=places, sensors=sensors)

# The specimen is 0.2 % stiffer and has stops on both sides of its second mass, which the model lacks.
gap, stiffness = 0.4e-3, 3e3
stops = [
    ElasticStop(name=f"stop {side:+.0f}", direction=side * places["mass 2"], stiffness=stiffness, gap=gap)
    for side in (1.0, -1.0)
]
specimen = JointedSystem(
    mass=system.mass, damping=system.damping, stiffness=1.002 * K, joints=stops, harmonic_force=force
)

# Sweeps up at four levels by time integration, harmonics 1 and 3 of each mass, two repeats with 0.3 % of noise.
levels, frequencies, random = (0.08, 0.2, 0.3, 0.4), np.linspace(12.0, 13.8, 20), np.random.default_rng(1)
bench = VirtualSweepTest(specimen, places)
motion = np.array([bench.sweep(frequencies.tolist(), level).motion for level in levels])
where = np.indices((2, *motion.shape)).reshape(5, -1)
repeat, level, frequency, sensor, harmonic = where
noise = 3e-3 * (random.standard_normal(len(level)) + 1j * random.standard_normal(len(level))) / np.sqrt(2)
value = np.tile(motion.ravel(), 2) * (1 + noise)
value += 0.003 * np.abs(motion[0, :, 0, 0]).max() * noise / np.abs(noise).max()
campaign = Campaign(
    title="chain", folder=folder, tests=(Test(name="stepped"),), held_out=HeldOut(levels=(0.3,)),
    sensors=tuple(MeasuredSensor(name=name, quantity="displacement", place=name) for name in places),
    measurement=Measurement(
        test=0 * level, order=np.arange(len(level)), repeat=repeat + 1, sweep=0 * level + 1,
        level=np.array(levels)[level], frequency=frequencies[frequency], sensor=sensor, harmonic=2 * harmonic + 1,
        value=value,
    ),
)  # fmt: skip

calibration = list_calibration_parameters(model, deviation={"E": 0.005})
budget = Budget(frequency=1e-4, compliance=0.0, shares=0.0)
first = arrange(campaign, model, calibration, budget)
recovery = recover_law(first)
assert recovery is not None
curves = compute_curves(recovery.best)
law = RecoveredLaw(law=recovery, curves=curves, words=describe(curves))
print("\n".join(law.sentences))
(folder / "missing_law.png").write_bytes(png(draw_missing_law(make_law_drawing(law, "Chain with stops"))))
(folder / "recovered_law.py").write_text(write_effect_file(recovery.best, curves, law.words), encoding="utf-8")

u = curves.spring.x
planted = stiffness * (u - np.clip(u, -gap, gap))
for number in range(0, len(u), 8):
    print(
        f"u = {1e3 * u[number]:6.2f} mm: planted {planted[number]:6.2f} N, recovered {curves.spring.mean[number]:6.2f}"
    )

# Second round: the file's effect, fitted with the calibration parameters.
effect = list_effects(model, extra=[folder / "recovered_law.py"], level=0.4).effect(law.name)
second = arrange(campaign, model, calibration, budget, added=[AddedEffect(effect=effect, values=(1.0,))])
errors = [item.tested(None, item.fit).held_out_error for item in (first, second)]
print(f"held-out error: {100 * errors[0]:.1f} %, with the recovered law {100 * errors[1]:.1f} %")
assert recovery.credible == ("mass 2",)
assert np.abs(curves.spring.mean - planted).max() < 0.1 * planted.max()
assert errors[1] < 0.1 * errors[0]
