"""A channel in g for m/s^2, inches or rms for peak is named; a model that is wrong raises nothing."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Suspicion, Test
from correlation.data_quality.constant_factor import find_constant_factors
from correlation.prediction import Points

G = 9.80665
LEVELS, FREQUENCY = (1.0, 3.0), np.linspace(85.0, 120.0, 24)
POINTS = [each.ravel() for each in np.meshgrid(LEVELS, FREQUENCY, np.arange(4), indexing="ij")]


def response(rng: np.random.Generator, shape: np.ndarray, error: float) -> np.ndarray:
    """Four accelerometers on two modes, which are off by a relative error in frequency, damping, size and shape."""
    level, frequency, sensor = POINTS
    moved = np.exp(error * rng.standard_normal(2)) ** 0.1 * (100.0, 230.0)
    damping = 0.02 * np.exp(error * rng.standard_normal()) * level**0.3
    shapes = shape * np.exp(error * rng.standard_normal((4, 2))) * np.exp(error * rng.standard_normal())
    item = 1 / (moved**2 - frequency[:, None] ** 2 + 2j * damping[:, None] * moved * frequency[:, None])
    return np.asarray(-level * frequency**2 * (item * shapes[sensor.astype(int)]).sum(axis=1))


def suspected(seed: int, error: float, *factors: float) -> tuple[Suspicion, ...]:
    """Readings of three repeats with 1 % of noise and a factor on each sensor, beside a model that is off."""
    rng = np.random.default_rng([4700, seed])
    shape = rng.uniform(0.3, 1, (4, 2)) * rng.choice([-1, 1], (4, 2))
    level, frequency, sensor = POINTS
    n = len(level)
    clean = response(rng, shape, 0.0) * np.array([*factors, *np.ones(4 - len(factors))])[sensor.astype(int)]
    dirt = rng.standard_normal((2, 3 * n))
    table = Measurement(
        test=np.zeros(3 * n, dtype=int), order=np.arange(3 * n), repeat=np.repeat([1, 2, 3], n),
        sweep=np.ones(3 * n, dtype=int), level=np.tile(level, 3), frequency=np.tile(frequency, 3),
        sensor=np.tile(sensor, 3).astype(int), harmonic=np.ones(3 * n, dtype=int),
        value=np.tile(clean, 3) * (1 + 0.01 * (dirt[0] + 1j * dirt[1])),
    )  # fmt: skip
    campaign = Campaign(
        title="", folder=Path(), tests=(Test(name="sine"),), held_out=HeldOut(), measurement=table,
        sensors=tuple(MeasuredSensor(name=name, quantity="acceleration", direction="z") for name in "abcd"),
    )  # fmt: skip
    names = np.array(list("abcd"))[sensor.astype(int)]
    points = Points(
        free=np.zeros(n, dtype=bool), level=level, frequency=frequency, sensor=names, harmonic=np.ones(n, dtype=int)
    )
    return find_constant_factors(campaign, points, response(rng, shape, error))


@pytest.mark.parametrize("error", [0.0, 0.05, 0.2, 0.4])
def test_models_that_are_wrong_raise_no_suspicion(error: float) -> None:
    # 0 of 500 for each error.
    assert [seed for seed in range(20) if suspected(seed, error)] == []


@pytest.mark.parametrize("factor", [1.4, 1.45, 0.73, 8.0, 12.0, 1000.0])
def test_another_factor_is_no_unit(factor: float) -> None:
    assert suspected(0, 0.01, factor) == ()
    assert suspected(0, 0.0, *[factor] * 4) == ()


@pytest.mark.parametrize(
    ("factor", "is_in", "said"),
    [(G, "m/s^2", "g_n"), (1 / G, "g_n", "m/s^2"), (25.4, "mm/s^2", "inch/s^2"), (1 / 0.0254, "inch/s^2", "m/s^2")],
)
@pytest.mark.parametrize("error", [0.0, 0.05])
def test_a_unit_of_one_channel_is_named_with_its_factor(factor: float, is_in: str, said: str, error: float) -> None:
    for seed in range(5):
        (result,) = suspected(seed, error, 1.0, factor)
        assert result.where == 'sensor "b"'
        assert f"values {is_in}, and read as {said}?" in result.sentence
        assert not result.remark


@pytest.mark.parametrize(("factor", "is_in", "said"), [(0.5**0.5, "rms", "peak"), (2.0, "peak to peak", "peak")])
def test_amplitudes_of_one_channel_and_of_all_are_a_remark(factor: float, is_in: str, said: str) -> None:
    """Of all, one beside the other: convention.amplitude is that of forces and responses alike."""
    asked = {'sensor "b"': f"values {is_in}, and read as {said}?"}
    asked["all sensors"] = f"are the responses {is_in} values, and the forces {said}?"
    for factors, where in (([1.0, factor], 'sensor "b"'), ([factor] * 4, "all sensors")):
        (result,) = suspected(0, 0.0, *factors)
        assert result.where == where
        assert asked[where] in result.sentence
        assert result.remark


def test_a_factor_of_ten_is_no_sure_unit() -> None:
    """The model is 5 % off: g and ten are not told apart."""
    told = [item for seed in range(10) for item in suspected(seed, 0.05, 1.0, 10.0)]
    assert told
    assert all("wrong by a factor of ten looks the same" in item.sentence for item in told)
