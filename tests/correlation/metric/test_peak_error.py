"""Errors of a resonance: exact for one mode, and their deviations as large as what they are off by chance."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.peak_error import ModePeaks, PeakError, PeakSource, compute_peak_errors
from correlation.noise.covariance import Whitening
from correlation.prediction import Points

FREQUENCY, DAMPING, REPEATS = 100.0, 0.01, 4
#: Three of these points are the peak, and nine.
COARSE, FINE = (FREQUENCY * np.linspace(0.95, 1.05, n) for n in (12, 80))


def response(
    frequency: NDArray[np.float64], resonance: float = FREQUENCY, damping: float = DAMPING, friction: float = 0.0
) -> NDArray[np.complex128]:
    """1 kg on a spring and a dashpot under 1 N; it slips on a wall whose force has the first harmonic `friction`.

    D a = F cos phi and c omega a + friction = F sin phi (Den Hartog's, with the wall's first harmonic alone).
    """
    omega, natural = 2 * np.pi * frequency, 2 * np.pi * resonance
    stiffness, dashpot = natural**2 - omega**2, 2 * damping * natural * omega
    both = stiffness**2 + dashpot**2
    amplitude = (np.sqrt((dashpot * friction) ** 2 + both * (1 - friction**2)) - dashpot * friction) / both
    return np.asarray(amplitude * (stiffness * amplitude - 1j * (dashpot * amplitude + friction)))


def observed(
    exact: NDArray[np.complex128], grid: NDArray[np.float64], noise: float = 0.0, seed: int = 1
) -> Observation:
    points = Points(
        free=np.zeros(len(grid), dtype=bool), level=np.ones(len(grid)), frequency=grid,
        sensor=np.full(len(grid), "tip"), harmonic=np.ones(len(grid), dtype=int),
    )  # fmt: skip
    random, shape = np.random.default_rng(seed), (len(grid), REPEATS)
    scatter = noise * (random.standard_normal(shape) + 1j * random.standard_normal(shape))
    return Observation(
        points=points,
        repeat=exact[:, None] * (1 + scatter),
        motion=np.ones(len(grid), dtype=bool),
        taken=np.ones(shape, dtype=bool),
    )


def peak(seen: Observation, predicted: NDArray[np.complex128], noise: float = 1e-6, shift: float = 0.0) -> PeakError:
    """With noise of a single repeat, a share of each modulus, and a shift of all frequencies in common."""
    features = FeatureVector.choose(seen.points, seen.value, seen.motion)
    modulus = np.tile(np.abs(1 / seen.value), 2)
    ends = [features.of_values(response(seen.points.frequency * (1 + item))) for item in (1e-6, -1e-6)]
    modes = shift * (ends[0] - ends[1])[:, None] / 2e-6
    whitening = Whitening(deviation=noise / 2 * modulus, modes=modes)
    source = PeakSource(observed=seen, predicted=predicted, features=features, whitening=whitening)
    (result,) = compute_peak_errors([source]).errors
    return result


@pytest.mark.parametrize("grid", [COARSE, FINE], ids=["3 points", "9 points"])
def test_errors_are_exact_for_one_degree_of_freedom(grid: NDArray[np.float64]) -> None:
    result = peak(observed(response(grid), grid), response(grid, 1.0005 * FREQUENCY, 1.2 * DAMPING))
    # The parabola of |1/X|^2 over the squared frequency is exact; round-off remains.
    assert result.frequency == pytest.approx(FREQUENCY, rel=1e-9)
    assert result.frequency_error == pytest.approx(0.0005, abs=1e-8)
    assert result.damping_error == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize("grid", [COARSE, FINE], ids=["3 points", "9 points"])
def test_a_peak_scatters_by_its_deviation(grid: NDArray[np.float64]) -> None:
    noise, exact = 0.01, response(grid)
    result = [peak(observed(exact, grid, noise, seed), exact, noise) for seed in range(200)]
    for errors in (
        [(item.frequency - item.predicted_frequency) / item.frequency_deviation for item in result],
        [(item.damping - item.predicted_damping) / item.damping_deviation for item in result],
    ):
        # 200 draws tell a standard deviation to 5 %, of which three are allowed; where noise bends a peak more than it
        # does on average, the deviation is too large.
        assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.15


def test_what_all_points_have_in_common_moves_the_frequency_alone() -> None:
    shift, exact = 3e-4, response(FINE)
    result = peak(observed(exact, FINE), exact, shift=shift)
    # A peak moves as all frequencies do: but for what the damping adds of second order.
    assert result.frequency_deviation == pytest.approx(shift * FREQUENCY, rel=1e-3)
    assert result.damping_deviation < 1e-3 * result.damping


def test_repeats_whose_resonances_are_apart_do_not_look_more_damped() -> None:
    apart = 0.2 * DAMPING  # by which a reading at the peak scatters by some 10 %
    seen = observed(response(COARSE), COARSE)
    repeat = np.column_stack([response(COARSE, FREQUENCY * (1 + item * apart)) for item in (-1, 1, -1, 1)])
    result = peak(
        Observation(points=seen.points, repeat=repeat, motion=seen.motion, taken=seen.taken), response(COARSE)
    )
    # Two in each direction: what is left is of second order, the square of the shift over the damping, 4e-4; the mean
    # of the responses is broader by a hundredth and more.
    assert abs(result.damping_error) < 1e-3
    assert result.frequency_error == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("step", [0.1, 0.2, 0.3, 0.5])
def test_friction_that_bends_a_peak_of_few_points_is_no_error_of_the_damping(friction: float, step: float) -> None:
    """The same friction and damping, only the resonance lies elsewhere between the points."""
    seen = observed(response(COARSE, friction=friction), COARSE)
    moved = FREQUENCY + step * (COARSE[1] - COARSE[0])
    result = peak(seen, response(COARSE, moved, friction=friction))
    off = abs(result.damping_error) * result.damping / result.damping_deviation
    # The peak is no parabola, so that where the points lie shows in what is read of it: by up to 2 % of the damping
    # here, thousands of deviations of the noise. Beside the parabola of five points that is one deviation or two.
    assert off < 2


def test_a_band_without_a_resonance_has_no_peak() -> None:
    seen = observed(response(COARSE), COARSE)
    below = seen.where(seen.points.frequency < 98)
    features = FeatureVector.choose(below.points, below.value, below.motion)
    whitening = Whitening(deviation=np.ones(2 * len(below.points)))
    source = PeakSource(observed=below, predicted=below.value, features=features, whitening=whitening)
    assert compute_peak_errors([source]) == ModePeaks()


#: Two bands of two sensors, a mode in each.
BANDS = np.concatenate([30 * np.linspace(0.93, 1.07, 29), 72 * np.linspace(0.95, 1.05, 29)])
SHAPES = ((1.0, 0.5), (0.4, -1.0))


def two_modes(
    levels: dict[float, tuple[tuple[float, float], tuple[float, float]]], scale: tuple[float, float] = (1.0, 1.0)
) -> Observation:
    """Levels by frequencies and damping ratios of two modes; a factor on each frequency."""
    rows = [
        (level, frequency, sensor, number)
        for level in levels
        for number, sensor in enumerate(("tip", "mid"))
        for frequency in BANDS.tolist()
    ]
    level, frequency, sensor, number = (np.array(column) for column in zip(*rows, strict=True))
    value = np.zeros(len(rows), dtype=np.complex128)
    for one, modes in levels.items():
        own = level == one
        for shape, (resonance, damping), factor in zip(SHAPES, modes, scale, strict=True):
            # Modal forces that make both peaks about as high.
            modal = response(frequency[own], factor * resonance, damping) * resonance**2
            value[own] += one * np.array(shape)[number[own]] * modal
    k = len(rows)
    points = Points(
        free=np.zeros(k, dtype=bool), level=level, frequency=frequency, sensor=sensor, harmonic=np.ones(k, dtype=int)
    )
    ones = np.ones((k, 1), dtype=bool)
    return Observation(points=points, repeat=value[:, None], motion=ones[:, 0], taken=ones)


def source(seen: Observation, predicted: NDArray[np.complex128]) -> PeakSource:
    features = FeatureVector.choose(seen.points, seen.value, seen.motion)
    whitening = Whitening(deviation=1e-6 * np.abs(features.of_values(seen.value)))
    return PeakSource(observed=seen, predicted=predicted, features=features, whitening=whitening)


#: The first mode is the higher one at 1 N, the second at 5 N.
MEASURED = {1.0: ((30.0, 0.005), (72.0, 0.02)), 5.0: ((29.5, 0.02), (71.0, 0.005))}


def test_each_mode_is_compared_with_itself_whichever_is_the_highest() -> None:
    """The model's heights are the other way round."""
    model = {1.0: ((30.0, 0.02), (72.0, 0.005)), 5.0: ((29.5, 0.005), (71.0, 0.02))}
    seen = two_modes(MEASURED)
    result = compute_peak_errors([source(seen, two_modes(model, (1.01, 0.99)).value)])
    assert result.unread == ()
    assert [(item.mode, item.level) for item in result.errors] == [(1, 1.0), (1, 5.0), (2, 1.0), (2, 5.0)]
    # What the other mode adds to a peak moves it by less than a thousandth; a mode is off by a hundredth.
    assert [item.frequency for item in result.errors] == pytest.approx([30.0, 29.5, 72.0, 71.0], rel=1e-3)
    assert [item.frequency_error for item in result.errors] == pytest.approx([0.01, 0.01, -0.01, -0.01], abs=1e-3)
    # The flank of the other mode is a part of a broad peak.
    assert [item.damping for item in result.errors] == pytest.approx([0.005, 0.02, 0.02, 0.005], rel=0.1)


def test_levels_of_several_sets_are_one_series_of_each_mode() -> None:
    sets = [two_modes({level: modes}) for level, modes in MEASURED.items()]
    joined = compute_peak_errors([source(seen, seen.value) for seen in sets])
    assert [(item.mode, item.level) for item in joined.errors] == [(1, 1.0), (1, 5.0), (2, 1.0), (2, 5.0)]


def test_a_mode_that_one_side_lacks_is_compared_with_none() -> None:
    """The model has the first mode only; and the other way round."""
    seen = two_modes(MEASURED)
    first = two_modes({level: (modes[0], (200.0, 0.01)) for level, modes in MEASURED.items()})
    result = compute_peak_errors([source(seen, first.value)])
    assert [item.mode for item in result.errors] == [1, 1, 2, 2]
    assert [np.isfinite(item.predicted_frequency) for item in result.errors] == [True, True, False, False]
    back = compute_peak_errors([source(first, seen.value)])
    assert [item.mode for item in back.errors] == [1, 1]
    (alone,) = back.unread
    assert "71.49 Hz at 1, 5 N" in alone
