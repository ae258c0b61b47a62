"""Frequency responses of the free structure count in a diagnosis as steady states of a linear structure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_type.linear_state import count_free_responses
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.response_modes import read_modes

FREQUENCY = np.arange(30.0, 70.0, 0.25)
TIP = MeasuredSensor(name="tip", quantity="displacement", place="tip", direction="z")


def response() -> MeasuredResponse:
    omega, random = 2 * np.pi * FREQUENCY[:, None], np.random.default_rng(3)
    own = 2 * np.pi * np.array([40.0, 55.0])
    value = (1 / (own**2 - omega**2 + 0.02j * own * omega)).sum(axis=1)
    value *= 1 + 0.003 * (random.standard_normal(len(value)) + 1j * random.standard_normal(len(value)))
    made = MeasuredResponse(
        name="hammer", test=-1, configuration="free", sensors=("tip",), frequency=FREQUENCY, value=value[None, :],
        units=("m per N",), coherence=np.ones((1, len(value))), level=None, repeat=1,
    )  # fmt: skip
    return read_modes(made, [TIP])


RESPONSE = response()


def campaign(*data: MeasuredResponse, configuration: str = "jointed") -> Campaign:
    three = np.zeros(3, dtype=int)
    return Campaign(
        title="one", folder=Path("one"), sensors=(TIP,), tests=(Test(name="swept", configuration=configuration),),
        held_out=HeldOut(), data=data,
        measurement=Measurement(
            test=three, order=np.arange(3), repeat=three + 1, sweep=three, level=np.full(3, 2.0),
            frequency=np.array([40.0, 41.0, 42.0]), sensor=three, harmonic=three + 1, value=np.ones(3, dtype=complex),
        ),
    )  # fmt: skip


def test_its_points_are_those_of_the_response_at_a_small_level() -> None:
    counted, names = count_free_responses(campaign(RESPONSE))
    assert names == ("hammer",)
    assert [test.configuration for test in counted.tests] == ["jointed", "free"]
    rows = counted.measurement.where(counted.measurement.test == 1)
    assert 20 <= len(rows) <= 60  # as many as fit, most of them at the resonances
    np.testing.assert_array_equal(rows.level, 2e-3)
    at = np.searchsorted(FREQUENCY, rows.frequency)
    np.testing.assert_allclose(rows.value, 2e-3 * RESPONSE.value[0, at], rtol=1e-12)
    assert len(counted.measurement) == 3 + len(rows)


@pytest.mark.parametrize(
    "change",
    [{"configuration": "jointed"}, {"level": 0.1, "test": 0}, {"held_out": True}, {"decay": 2.0}, {"fit": None}],
)
def test_others_do_not_count(change: dict[str, object]) -> None:
    before = campaign(replace(RESPONSE, **change))  # type: ignore[arg-type]
    assert count_free_responses(before) == (before, ())


def test_a_response_with_leakage_does_not_count() -> None:
    assert RESPONSE.fit is not None
    before = campaign(replace(RESPONSE, fit=replace(RESPONSE.fit, leaks=True)))
    assert count_free_responses(before) == (before, ())


def test_steady_states_of_the_free_structure_stand_alone() -> None:
    before = campaign(RESPONSE, configuration="free")
    assert count_free_responses(before) == (before, ())


def test_noise_at_an_antiresonance_draws_no_states_there_whatever_the_coherence_says() -> None:
    """A single average has a coherence of 1."""
    frequency = np.arange(30.0, 70.0, 0.05)
    omega, own, random = 2 * np.pi * frequency[:, None], 2 * np.pi * np.array([40.0, 60.0]), np.random.default_rng(4)
    exact = (1 / (own**2 - omega**2 + 0.02j * own * omega)).sum(axis=1)
    noise = 2 * np.abs(exact).min()
    value = exact + noise * (random.standard_normal(len(exact)) + 1j * random.standard_normal(len(exact)))
    drowned = replace(RESPONSE, frequency=frequency, value=value[None, :], coherence=np.ones((1, len(value))))
    counted, _ = count_free_responses(campaign(drowned))
    rows = counted.measurement.where(counted.measurement.test == 1)
    assert (np.abs(exact[np.isin(frequency, rows.frequency)]) > 2 * noise).all()
    # The first resonance, 0.8 Hz wide, turns by half a circle within five widths.
    assert (np.abs(rows.frequency - 40.0) < 2.0).sum() >= 6
