"""What ring-downs and loops show by themselves: trends of frequency and damping, play, work."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from correlation.data_type.indication import Indication, name_causes
from correlation.data_type.loop_indication import list_loop_indications
from correlation.data_type.loop_prediction import predict_loop
from correlation.data_type.measured_loop import ForceLoop
from correlation.data_type.ring_down import FreeDecay, choose_rows, list_ring_down_indications, predict_ring_down
from correlation.model import Model
from correlation.signal.loop import analyse_loop
from correlation.signal.ring_down import analyse_ring_down
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.jenkins import JenkinsElement
from tests.slow import slow

STIFFNESS, MASS, RATIO = 5e5, 1.3, 0.004
STROKE = np.cos(np.linspace(0, 8 * np.pi, 4001))


@cache
def decay(softening: float, drag: float, seed: int, noise: float = 1e-3) -> FreeDecay:
    """A decay whose frequency falls by a share, and whose damping rises by one, from nothing to 1 mm."""
    omega, step, n = np.sqrt(STIFFNESS / MASS), 1 / 2500, 4000
    amplitude, phase, x = 1e-3 * (1 + 0.1 * seed), 0.0, np.empty(n)
    for number in range(n):
        x[number] = amplitude * np.cos(phase)
        amplitude *= np.exp(-RATIO * omega * (1 + drag * amplitude / 1e-3) * step)
        phase += omega * (1 - softening * (amplitude / 1e-3) ** 2) * step
    x += noise * 1e-3 * np.random.default_rng(seed).standard_normal(n)
    time = np.arange(n) * step
    return FreeDecay(
        name=f"{seed}", configuration="jointed", sensor="tip", unit="m", time=time, signal=x,
        modes=analyse_ring_down(time, x, quantity="displacement"),
    )  # fmt: skip


def trends(model: Model, softening: float, drag: float) -> dict[str, Indication]:
    decays = [decay(softening, drag, seed) for seed in (1, 2, 3)]
    indications = list_ring_down_indications(model, decays, [predict_ring_down(model, item) for item in decays])
    return {indication.kind: indication for indication in indications}


def test_a_falling_frequency_and_a_rising_damping_are_signs_of_slip(oscillator: Callable[..., Model]) -> None:
    result = trends(oscillator(), softening=0.01, drag=0.5)
    assert result["frequency"].is_clear
    assert result["frequency"].difference < 0
    assert result["damping"].is_clear
    assert result["damping"].difference > 0
    assert "falls from 9" in result["frequency"].measured
    assert "stays at 98.7 Hz" in result["frequency"].predicted
    assert "slip in joints" in name_causes(list(result.values()))


def test_a_trend_is_told_by_its_readings(oscillator: Callable[..., Model]) -> None:
    """A frequency that falls with the square of the amplitude lies on no straight line over its logarithm."""
    of, model = decay(0.1, 0.0, 1), oscillator()
    result, _ = list_ring_down_indications(model, [of], [predict_ring_down(model, of)])
    mode = of.modes[0]
    rows = choose_rows(mode)
    low, high = rows[np.argmin(mode.amplitude[rows])], rows[np.argmax(mode.amplitude[rows])]
    assert result.measured.startswith(f"falls from {mode.frequency[low]:.4g} to {mode.frequency[high]:.4g} Hz")


def test_decays_of_two_structures_and_sensors_are_not_averaged(oscillator: Callable[..., Model]) -> None:
    """Free of contacts, and read as an acceleration, a mode of the same frequency has trends of its own."""
    falling, linear = decay(0.01, 0.5, 1), decay(0.0, 0.0, 2)
    others = [replace(linear, configuration="free"), replace(linear, sensor="accelerometer", unit="m/s^2")]
    decays, model = [falling, *others], oscillator()
    indications = list_ring_down_indications(model, decays, [predict_ring_down(model, item) for item in decays])
    alone = list_ring_down_indications(model, [falling], [predict_ring_down(model, falling)])
    assert len(indications) == 6
    assert len({indication.quantity for indication in indications}) == 6
    by_quantity = {indication.quantity: indication for indication in indications}
    assert all(by_quantity[indication.quantity] == indication for indication in alone)
    assert {indication.measured.split()[-1] for indication in indications} == {"m", "m/s^2"}


def test_channels_of_one_place_are_one_trend_named_by_its_own_frequency(oscillator: Callable[..., Model]) -> None:
    """A recorder that names each decay of one sensor anew has not measured several places."""
    model = oscillator()
    sensor = model.sensors[0]
    channels = [replace(decay(0.01, 0.5, seed), sensor=f"v{seed}") for seed in (1, 2, 3)]
    model = Model(**{**vars(model), "sensors": tuple(replace(sensor, name=item.sensor) for item in channels)})
    result = list_ring_down_indications(model, channels, [predict_ring_down(model, item) for item in channels])
    assert [item.kind for item in result] == ["frequency", "damping"]
    assert all(item.is_clear and "at v1 and 2 more" in item.quantity for item in result)


def test_a_linear_decay_shows_nothing(oscillator: Callable[..., Model]) -> None:
    result = trends(oscillator(), softening=0.0, drag=0.0)
    assert not any(indication.is_clear for indication in result.values())
    assert name_causes(list(result.values())) == ""


@slow
def test_a_model_that_hardens_as_the_decay_does_shows_the_same(oscillator: Callable[..., Model]) -> None:
    """w = w0 sqrt(1 + 3 k3 A^2 / (4 k)): by 1 % at 1 mm."""
    hardening = CubicSpring(name="cubic", direction=np.ones(1), stiffness=0.02 * STIFFNESS / 0.75 / 1e-6)
    assert trends(oscillator(), softening=-0.01, drag=0.0)["frequency"].is_clear
    result = trends(oscillator(hardening), softening=-0.01, drag=0.0)
    # The curves differ by 3/8 q^2 of the series: 4e-5.
    assert abs(result["frequency"].difference) < 5


def loop(force: np.ndarray, amplitude: float = 1e-3) -> ForceLoop:
    x = amplitude * STROKE
    return ForceLoop(name="loop", displacement=x, force=force, loops=analyse_loop(x, force), frequency=1.0, place="tip")


def slide(x: np.ndarray, stiffness: float, limit: float, play: float = 0.0) -> np.ndarray:
    """A Jenkins element behind a dead zone."""
    slider, force = 0.0, np.empty(len(x))
    for number, here in enumerate(x):
        gap = here - slider
        stretch = np.sign(gap) * max(abs(gap) - play / 2, 0.0)
        force[number] = np.clip(stiffness * stretch, -limit, limit)
        if abs(stiffness * stretch) > limit:
            slider = here - np.sign(gap) * (limit / stiffness + play / 2)
    return force


@pytest.mark.parametrize("play", [5e-5, 2e-4, 6e-4])
def test_play_is_read_in_metres(play: float) -> None:
    result = analyse_loop(1e-3 * STROKE, slide(1e-3 * STROKE, 1e5, 10.0, play))
    # Two samples of the stroke, where it is fastest.
    assert result.dwell == pytest.approx(play, abs=1.3e-5)


@pytest.mark.parametrize("limit", [5.0, 30.0, 80.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_joint_without_play_has_none(limit: float, noise: float) -> None:
    force = slide(1e-3 * STROKE, 1e5, limit) + noise * limit * np.random.default_rng(3).standard_normal(len(STROKE))
    assert analyse_loop(1e-3 * STROKE, force).dwell == 0.0


def test_loops_show_work_and_play_that_the_model_lacks(
    oscillator: Callable[..., Model], jenkins: JenkinsElement
) -> None:
    # The grip of the bench bears against the spring of the oscillator beside the slider.
    x = 1e-3 * STROKE
    own, model = STIFFNESS * x, oscillator(jenkins)
    same = loop(own + slide(x, jenkins.tangential_stiffness, jenkins.limit_force))
    indications = {item.kind: item for item in list_loop_indications(model, [same], [predict_loop(model, same)])}
    assert not any(indication.is_clear for indication in indications.values())
    loose = loop(slide(x, 1e6, 200.0, play=3e-4))
    indications = {item.kind: item for item in list_loop_indications(model, [loose], [predict_loop(model, loose)])}
    assert indications["play"].is_clear
    # W = 4 F (A - F/k - play/2) over the way 2 (2 A - play): 200 N (1 - 0.2 / 0.85), with the samples of the stroke.
    near, force = indications["play"].measured.removesuffix(" N on average over the rest of the stroke").split(", and ")
    assert near == "stays near zero over 0.3 mm"
    assert float(force.removeprefix("resists with ")) == pytest.approx(200 * (1 - 0.2 / 0.85), rel=0.01)
    assert indications["work"].is_clear
    assert "backlash" in name_causes(list(indications.values()))


@pytest.mark.parametrize(("play", "sign"), [(0.0, "friction that slides"), (3e-4, "hysteresis with play")])
def test_work_in_proportion_to_the_amplitude_is_a_sign_of_sliding(
    oscillator: Callable[..., Model], play: float, sign: str
) -> None:
    """W = 4 F (A - F/k - play/2), beside the square of a linear model."""
    model = oscillator()
    loops = [loop(slide(size * STROKE, 1e6, 200.0, play), size) for size in (1e-3, 1.5e-3, 2.2e-3)]
    result = list_loop_indications(model, loops, [predict_loop(model, item) for item in loops])
    (growth,) = (item for item in result if item.kind == "slow growth")
    lost = 200.0 / 1e6 + play / 2
    expected = np.log((2.2e-3 - lost) / (1e-3 - lost)) / np.log(2.2)
    # The slope of the line through three points of a slightly bent curve is within a few per cent of that of its chord.
    assert float(growth.measured.split()[-1]) == pytest.approx(expected, rel=0.03)
    assert growth.predicted == "with its power 2.00"
    assert growth.is_clear
    assert sign in name_causes(result)
