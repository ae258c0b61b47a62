"""Warming compiles all that another system needs."""

import subprocess
import sys

#: Runs in a process of its own: other tests would have compiled what warming forgot.
SCRIPT = """
import numpy as np
from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from hbsolve import aft, newton, state_sequence
from hbsolve import compile_ahead
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from reduction.jointed_system import ElasticStop, Friction, FrictionContact, JointedSystem

compile_ahead.compile_kernels()
functions = (aft.joint_forces, newton.newton, newton.bordered_step, newton.apply_receptance,
             state_sequence.follow)
before = [len(each.signatures) for each in functions]
rows = np.eye(3)
joints = [
    FrictionContact(name="pad", normal=rows[2], tangents=rows[:2], normal_stiffness=2.0, tangential_stiffness=1.0,
                    friction_coefficient=0.4, preload=0.5, friction=Friction.COULOMB),
    ElasticStop(name="stop", direction=rows[0], stiffness=0.5, gap=0.1),
]
force = np.zeros((3, 3), complex)
force[1:, 0] = 1.0, 0.2j
system = JointedSystem(mass=rows, damping=0.1 * rows, stiffness=rows, joints=joints, harmonic_force=force)
frequency_response(HarmonicBalance(system=system, n_harmonic=5), 0.5, 0.6)
model = Model(system=system, sensors=(Sensor(name="tip", row=rows[0]),), lines={}, places={}, n_harmonic=5)
points = Points(free=np.zeros(2, bool), level=np.ones(2), frequency=np.array([0.08, 0.09]),
                sensor=np.array(["tip", "tip"]), harmonic=np.ones(2, int))
Predictor(points=points, sweeps=(1, -1)).predict(model)
print(before, [len(each.signatures) for each in functions])
"""


def test_another_system_compiles_nothing_more() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    before, after = done.stdout.strip().split("] [")
    assert before.strip("[") == after.strip("]")
    assert "0" not in before
