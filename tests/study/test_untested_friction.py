"""Friction that no reading shows is called untested, and friction that one shows is not."""

from types import SimpleNamespace

import numpy as np
import pytest

from correlation.data_type.measured_loop import ForceLoop
from correlation.data_type.mode import MeasuredMode
from correlation.model import Model, Sensor
from correlation.noise.covariance import Whitening
from correlation.prediction import Points, Predictor
from correlation.signal.loop import analyse_loop
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem
from study.compare.untested_friction import find_untested_friction

SPRING, LIMIT = 1e5, 2.0


def model(*, rubs: bool = True) -> Model:
    """A mass on a spring, held by a slider besides."""
    row = np.array([1.0])
    joints = (
        [JenkinsElement(name="slider", direction=row, tangential_stiffness=SPRING, limit_force=LIMIT)] if rubs else []
    )
    force = np.array([[0.0], [1.0]], dtype=np.complex128)
    system = JointedSystem(
        mass=np.eye(1), damping=np.array([[5.0]]), stiffness=np.array([[SPRING]]), joints=joints, harmonic_force=force
    )
    return Model(system=system, sensors=(Sensor(name="x", row=row),), places={"end": row})


def mode(configuration: str = "jointed") -> MeasuredMode:
    frequency = np.sqrt((2 if configuration == "jointed" else 1) * SPRING) / (2 * np.pi)
    return MeasuredMode(
        name="first", configuration=configuration, frequency=frequency, frequency_deviation=1e-3 * frequency
    )


def loop(amplitude: float) -> ForceLoop:
    """The loop of the spring and the slider under an imposed displacement."""
    x = amplitude * np.cos(2 * np.pi * np.arange(5 * 200) / 200)
    slider, f = 0.0, np.zeros(len(x))
    for row, at in enumerate(x):
        rub = np.clip(SPRING * (at - slider), -LIMIT, LIMIT)
        slider, f[row] = at - rub / SPRING, SPRING * at + rub
    return ForceLoop(name="loop", displacement=x, force=f, loops=analyse_loop(x, f), frequency=1.0, place="end")


def test_modes_and_loops_that_stick_do_not_test_friction() -> None:
    (result,) = find_untested_friction(model(), [mode(), mode("free"), loop(0.5 * LIMIT / SPRING)])
    assert result.remark
    assert "friction was not tested" in result.headline
    assert "larger amplitudes" in result.sentence
    (of_free,) = find_untested_friction(model(), [mode("free")])
    assert "with its contacts, too" in of_free.sentence


def test_one_loop_that_slips_is_enough() -> None:
    assert not list(find_untested_friction(model(), [mode(), loop(3 * LIMIT / SPRING)]))


def test_a_model_without_friction_has_none_to_test() -> None:
    assert not list(find_untested_friction(model(rubs=False), [mode()]))


@pytest.mark.parametrize(("level", "slips"), [(0.1, False), (30.0, True)])
def test_steady_states_test_friction_from_where_they_slip(level: float, slips: bool) -> None:
    frequency = np.linspace(60.0, 80.0, 9)
    same = np.ones(9)
    points = Points(
        free=np.zeros(9, dtype=bool), level=level * same, frequency=frequency, sensor=np.array(["x"] * 9),
        harmonic=np.ones(9, dtype=np.int64),
    )  # fmt: skip
    prediction = Predictor(points=points).predict(model())
    features = SimpleNamespace(of_values=lambda values: np.concatenate([values.real, values.imag]))
    # 1 % of what a spring of this stiffness gives.
    comparison = SimpleNamespace(features=features, whitening=Whitening(deviation=np.full(18, 0.01 * level / SPRING)))
    assert bool(list(find_untested_friction(model(), [], (comparison, prediction)))) == (not slips)  # type: ignore[arg-type]
