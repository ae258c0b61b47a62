"""Two effects that tests cannot tell apart: ask what to measure next, measure it, and diagnose again.

python examples/plan_the_next_test.py [FOLDER]     # takes a minute; writes next_test.png to FOLDER
"""

import sys
from pathlib import Path

import numpy as np

from correlation.campaign.join_campaigns import join_campaigns
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model, Sensor
from correlation.noise.nuisance import Budget
from correlation.sensor_placement import with_sensors
from diagnosis.diagnose import diagnose
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.next_test.advise import advise
from figure.next_test import draw_next_tests
from figure.style import png
from reduction.jointed_system import JointedSystem
from study.diagnose.next_test import NextStep
from study.diagnose.next_test_drawing import make_next_tests
from transient.virtual_bench.sweep import VirtualSweepTest

folder, random = Path(sys.argv[1] if len(sys.argv) > 1 else "."), np.random.default_rng(1)
K, M = 4e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)), np.diag([1.2, 0.9, 1.1, 0.8])
K[3, 3] = 4e4
places, force = {f"mass {number + 1}": np.eye(4)[number] for number in range(4)}, np.zeros((2, 4))
force[1, 3] = 1.0
system = JointedSystem(mass=M, damping=2.5e-4 * K, stiffness=K, harmonic_force=force)
model = Model(system=system, places=places, sensors=(Sensor(name="mass 4", row=places["mass 4"]),))
# The specimen has 30 g more on its third mass, 5 % more damping, and is 0.1 % stiffer.
specimen = JointedSystem(
    mass=M + 0.03 * np.diag([0, 0, 1, 0]), damping=1.05 * system.damping, stiffness=1.001 * K, harmonic_force=force
)


def measure(levels: tuple[float, ...], frequencies: tuple[float, ...], at: tuple[str, ...], held: HeldOut) -> Campaign:
    """Sweeps up by time integration, three repeats with 0.5 % of noise."""
    bench = VirtualSweepTest(specimen, places)
    motion = np.array([bench.sweep([*frequencies], level).motion[..., 0] for level in levels])
    motion = motion[:, :, [list(places).index(place) for place in at]]
    repeat, level, frequency, sensor = np.indices((3, *motion.shape)).reshape(4, -1)
    noise = 5e-3 * (random.standard_normal(len(level)) + 1j * random.standard_normal(len(level))) / np.sqrt(2)
    table = Measurement(
        test=0 * level, order=np.arange(len(level)), repeat=repeat + 1, sweep=0 * level + 1,
        level=np.array(levels)[level], frequency=np.array(frequencies)[frequency], sensor=sensor,
        harmonic=0 * level + 1, value=np.tile(motion.ravel(), 3) * (1 + noise),
    )  # fmt: skip
    sensors = tuple(MeasuredSensor(name=place, quantity="displacement", place=place) for place in at)
    return Campaign(
        title="Chain", folder=folder, tests=(Test(name="sweep"),), sensors=sensors, measurement=table, held_out=held
    )


calibration = list_calibration_parameters(model, deviation={"E": 0.003})
budget = Budget(frequency=1e-4, compliance=0.0, shares=0.0)
first = measure((0.1, 0.2, 0.3), tuple(np.linspace(10.6, 12.0, 16).tolist()), ("mass 4",), HeldOut(levels=(0.2,)))
diagnosis = diagnose(first, model, calibration, budget)
print(diagnosis.verdict.sentence, "\n")

# What to measure next: the tests that separate these effects best, by the fitted models themselves.
step = NextStep(advice=advise(first, diagnosis.arrangement, diagnosis.verdict))
assert step.advice is not None
print(step.sentence, "\n")
for item in step.shown:
    print(f"  {100 * item.probability:5.1f} %  {item.test.minutes:3.0f} min  {item.test.title}")
picture = png(draw_next_tests(make_next_tests(step, "Chain with a hidden mass", {"mass 4": "m"})))
(folder / "next_test.png").write_bytes(picture)

# That test, measured on the specimen, and all data diagnosed together.
test = step.advice.best.test
seen = (*test.sensors, *([] if test.place is None else [test.place]))
both = join_campaigns(first, measure(test.levels, test.frequencies, seen, HeldOut()))
second = diagnose(both, with_sensors(model, both), calibration, budget)
print(f"\n{second.verdict.sentence}\nHidden: 0.03 kg at mass 3")
assert diagnosis.verdict.finding.value == "ambiguous"
assert [item.name for item in second.verdict.effects] == ["mass at mass 3"]
