"""Frequency responses of another size than the model's: suspected with the factor, and no model that is merely off."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.campaign.measurement import MeasuredSensor
from correlation.data_quality.response import find_response_suspicions
from correlation.data_type.linear_response import predict_linear_response
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.response_modes import read_modes
from correlation.model import Model, Sensor
from reduction.jointed_system import JointedSystem

NAMES = ("a", "b", "c")


def chain(factors: np.ndarray | None = None) -> Model:
    """Three masses on springs between two walls, masses and springs times some factors."""
    factors = np.ones(7) if factors is None else factors
    springs = 4e4 * np.array([1.0, 1.4, 0.8, 1.2]) * factors[3:]
    stiffness = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    force = np.zeros((2, 3), dtype=np.complex128)
    force[1, 0] = 1.0
    mass = np.diag([1.0, 1.3, 0.9] * factors[:3])
    system = JointedSystem(mass=mass, damping=1e-4 * stiffness, stiffness=stiffness, joints=[], harmonic_force=force)
    rows = zip(NAMES, np.eye(3), strict=True)
    sensors = tuple(Sensor(name=name, row=row, quantity="acceleration") for name, row in rows)
    return Model(system=system, sensors=sensors)


@pytest.fixture(scope="module")
def right() -> MeasuredResponse:
    """Responses of the chain itself, with their modes."""
    frequency = np.arange(15.0, 70.0, 0.1)
    empty = MeasuredResponse(
        name="hammer", test=-1, configuration="jointed", sensors=NAMES, frequency=frequency,
        value=np.zeros((3, len(frequency)), dtype=complex), units=("m/s^2 per N",) * 3,
        coherence=np.ones((3, len(frequency))), level=None, repeat=1,
    )  # fmt: skip
    sensors = [MeasuredSensor(name=name, quantity="acceleration", direction="x", place=name) for name in NAMES]
    result = read_modes(replace(empty, value=predict_linear_response(chain(), empty)), sensors)
    assert len(result.modes) == 3
    return result


def times(response: MeasuredResponse, factor: np.ndarray | float, power: int = 0) -> MeasuredResponse:
    """The responses with a factor on each sensor, and a power of i omega: the fit of modes is linear in both."""
    assert response.fit is not None
    own = np.ones(3) * factor
    omega = 2j * np.pi * response.fit.frequency
    residues = own[:, None] * response.fit.residues * omega**power
    return replace(response, fit=replace(response.fit, residues=residues))


def test_the_same_responses_and_models_that_are_off_are_not_suspected(right: MeasuredResponse) -> None:
    assert not find_response_suspicions(chain(), [right])
    random = np.random.default_rng(4)
    for _ in range(30):
        assert not find_response_suspicions(chain(np.exp(0.15 * random.standard_normal(7))), [right])


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e3, ("1,000 times", "mm/s^2", "kN")),
        (1e-3, ("0.001 times", "m/s^2 and read as mm/s^2", "mN")),
        (9.80665, ("9.81 times", "g_n")),
        (4.4482216, ("4.45 times", "lbf")),
        (2.5, ("2.5 times", "sensitivity")),
    ],
)
def test_a_factor_on_all_sensors_is_named_with_what_it_may_be(
    right: MeasuredResponse, factor: float, words: tuple[str, ...]
) -> None:
    # A model that is 3 % off does not hide it.
    model = chain(np.exp(0.03 * np.random.default_rng(2).standard_normal(7)))
    result = find_response_suspicions(chain(), [times(right, factor)])
    assert [item.where for item in result] == ["hammer"]
    assert all(word in result[0].sentence for word in words)
    assert [item.where for item in find_response_suspicions(model, [times(right, factor)])] == ["hammer"]


def test_a_factor_of_one_sensor_is_its_own(right: MeasuredResponse) -> None:
    wrong = times(right, np.array([1.0, 1e3, 1.0]))
    assert [item.where for item in find_response_suspicions(chain(), [wrong]) if "1,000" in item.sentence] == [
        'hammer, "b"'
    ]


@pytest.mark.parametrize(("power", "name"), [(-1, "velocity"), (-2, "displacement")])
@pytest.mark.parametrize("factor", [1.0, 1e6])
def test_another_quantity_is_told_by_the_power_of_the_frequency(
    right: MeasuredResponse, power: int, name: str, factor: float
) -> None:
    (result,) = find_response_suspicions(chain(), [times(right, factor, power)])
    assert f"are these numbers a {name}" in result.sentence
    assert ("1,000,000 times" in result.sentence) == (factor > 1)


@pytest.mark.parametrize("unit", ["V per N", "m/s^2 per V", "percent per %"])
def test_a_sensor_or_drive_of_unknown_gain_may_have_any_factor(right: MeasuredResponse, unit: str) -> None:
    off = times(right, 1e3)
    assert find_response_suspicions(chain(), [off])
    assert not find_response_suspicions(chain(), [replace(off, units=(unit,) * 3)])
