"""Stiffnesses of a case in another unit than meant."""

import numpy as np

from benchmarks.wrong_stiffness import score
from correlation.model import Model, Sensor
from correlation.prediction import Points, Predictor
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem
from study.compare.gross_misfit import MotionReadings
from study.compare.wrong_stiffness import find_wrong_stiffness
from tests.slow import slow

#: Of the mass with its contact stuck: 1 kg on 1e6 + 1e6 N/m [Hz].
RESONANCE = np.sqrt(2e6) / (2 * np.pi)


def model(factor: float = 1.0) -> Model:
    """A mass on a spring and a contact, and a second mass with the same resonance that nothing drives or sees."""
    contact = JenkinsElement(
        name="contact", direction=np.array([1.0, 0.0]), tangential_stiffness=factor * 1e6, limit_force=30.0
    )
    stiffness, force = np.diag([1e6, 2e6]), np.array([[0.0, 0.0], [1.0, 0.0]], dtype=complex)
    system = JointedSystem(
        mass=np.eye(2), damping=20.0 * np.eye(2), stiffness=stiffness, joints=[contact], harmonic_force=force
    )
    return Model(system=system, sensors=(Sensor(name="a", row=np.array([1.0, 0.0])),))


def read(case: Model) -> MotionReadings:
    """What the right model reads at two levels, whose higher one makes the contact slip, and what a case does there."""
    level, frequency = (
        grid.ravel() for grid in np.meshgrid([0.3, 3.0], RESONANCE * np.linspace(0.94, 1.05, 8), indexing="ij")
    )
    k = len(level)
    points = Points(
        free=np.zeros(k, dtype=bool), level=level, frequency=frequency, sensor=np.array(["a"] * k),
        harmonic=np.ones(k, dtype=np.int64),
    )  # fmt: skip
    value, stated = (Predictor(points=points).predict(item).value for item in (model(), case))
    return MotionReadings(points=points, value=value, stated=stated)


def test_a_resonance_that_no_force_drives_and_no_sensor_sees_hides_no_wrong_unit() -> None:
    (result,) = find_wrong_stiffness(read(model(1e3)), model(1e3))
    assert result.where == 'joint "contact"'
    assert "tangential_stiffness 0.001 times that of the case" in result.sentence
    assert not find_wrong_stiffness(read(model()), model())


def test_readings_are_picked_of_all_sensors() -> None:
    k = 40
    points = Points(
        free=np.zeros(k, dtype=bool), level=np.ones(k), frequency=np.repeat(np.arange(1.0, 21.0), 2),
        sensor=np.tile(["a", "b"], 20), harmonic=np.ones(k, dtype=np.int64),
    )  # fmt: skip
    picked = MotionReadings(points=points, value=np.ones(k, complex), stated=np.ones(k, complex)).some(16)
    assert len(picked.value) == 16
    assert set(picked.points.sensor) == {"a", "b"}


@slow
def test_units_of_random_chains_are_found_and_hardly_any_other_error_looks_like_one() -> None:
    count = score("chains", 0, 20, lambda _: None)
    # Of 60 other chains about half; without a wrong unit about one in a hundred.
    assert count["found"] >= count["unit"] / 4 > 0
    assert count["false"] + count["wrong place"] <= 1
