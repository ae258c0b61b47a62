"""Loops of laws whose work, stiffness and friction are known in closed form."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.loop import analyse_loop, find_periods
from correlation.signal.stick_slip import Estimate, estimate_stick_slip
from tests.slow import slow

Array = NDArray[np.float64]
STIFFNESS, LIMIT, AMPLITUDE = 2e6, 4.0, 1e-5


def elements(displacement: Array, stiffness: Array, limit: Array) -> Array:
    """Force of Jenkins elements in parallel by their definition, limits of shape (j,) or (n, j)."""
    limits = np.broadcast_to(limit, (len(displacement), len(stiffness)))
    slider, forces = np.zeros(len(stiffness)), np.zeros(len(displacement))
    for i, place in enumerate(displacement):
        force = np.clip(stiffness * (place - slider), -limits[i], limits[i])
        slider = place - force / stiffness
        forces[i] = force.sum()
    return forces


def motion(n_period: int = 8, samples: int = 500, ramp: float = 2.0) -> Array:
    """Ramp in over some periods, constant amplitude, ramp out."""
    turn = np.arange((n_period + 2 * ramp) * samples) / samples
    window = np.clip(turn / ramp, 0, 1) * np.clip((n_period + 2 * ramp - turn) / ramp, 0, 1)
    return AMPLITUDE * window * np.cos(2 * np.pi * turn)


def test_work_and_secant_stiffness_of_a_jenkins_element_are_the_closed_forms() -> None:
    x = motion()
    loops = analyse_loop(x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])))
    (plateau,) = loops.plateaus
    # Sampled corners: (2 pi / 500)^2 of the stroke, 1.6e-4; ramps reach 5e-3 of the amplitude into the first period.
    assert plateau.work[0] == pytest.approx(4 * LIMIT * (AMPLITUDE - LIMIT / STIFFNESS), rel=1e-3)
    assert plateau.secant_stiffness[0] == pytest.approx(LIMIT / AMPLITUDE, rel=1e-3)
    assert plateau.amplitude[0] == pytest.approx(AMPLITUDE, rel=1e-4)
    assert abs(plateau.force_offset[0]) < 1e-3 * LIMIT
    assert abs(plateau.closing_error[0]) < 1e-2


def test_ramps_belong_to_no_plateau() -> None:
    x = motion(ramp=4.0)
    loops = analyse_loop(x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])))
    (plateau,) = loops.plateaus
    assert 6 <= plateau.n_period <= 9
    settled = loops.amplitude[loops.plateau == 0]
    np.testing.assert_allclose(settled, AMPLITUDE, rtol=0.02)  # the tolerance of a plateau
    assert (loops.plateau == -1).sum() >= 4


def test_two_amplitudes_are_two_plateaus() -> None:
    x = np.concatenate([motion(6, ramp=1.0), 0.4 * motion(6, ramp=1.0)])
    loops = analyse_loop(x, STIFFNESS * x)
    assert [round(plateau.amplitude[0] / AMPLITUDE, 2) for plateau in loops.plateaus] == [1.0, 0.4]


def test_noise_neither_lifts_the_amplitude_nor_adds_periods() -> None:
    random = np.random.default_rng(0)
    x = motion()
    f = elements(x, np.array([STIFFNESS]), np.array([LIMIT]))
    noisy = x + 0.01 * AMPLITUDE * random.standard_normal(len(x))
    (plateau,) = analyse_loop(noisy, f + 0.02 * LIMIT * random.standard_normal(len(x))).plateaus
    # The largest of 500 noisy samples would be 0.03 amplitudes too high.
    assert plateau.amplitude[0] == pytest.approx(AMPLITUDE, rel=0.008)
    work = 4 * LIMIT * (AMPLITUDE - LIMIT / STIFFNESS)
    assert abs(plateau.work[0] - work) < 4 * plateau.work[1] + 1e-3 * work
    assert 6 <= plateau.n_period <= 9


@pytest.mark.parametrize(("drift", "suspected"), [(0.1, True), (0.01, False)])
def test_loops_that_do_not_close_are_suspected(drift: float, suspected: bool) -> None:
    x = motion()
    f = elements(x, np.array([STIFFNESS]), np.array([LIMIT]))
    loops = analyse_loop(x, f + 2 * LIMIT * drift * np.arange(len(x)) / 500)
    # The drift adds its share to the range that it is compared with.
    assert abs(loops.plateaus[0].closing_error[0]) == pytest.approx(drift / (1 + drift), rel=0.1)
    assert any("do not close" in sentence for sentence in loops.suspicions) == suspected


def test_offsets_are_those_of_the_sensors() -> None:
    x = motion()
    f = elements(x, np.array([STIFFNESS]), np.array([LIMIT]))
    (plateau,) = analyse_loop(x + 3e-5, f - 7.0).plateaus
    assert plateau.force_offset[0] == pytest.approx(-7.0, abs=1e-2)
    assert plateau.displacement_offset[0] == pytest.approx(3e-5, rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_a_joint_that_sticks_is_not_said_to_give_energy(seed: int) -> None:
    random, x = np.random.default_rng(100 + seed), motion()
    noise = 0.01 * random.standard_normal((2, len(x)))
    loops = analyse_loop(x + AMPLITUDE * noise[0], STIFFNESS * (x + AMPLITUDE * noise[1]))
    assert not any("energy" in sentence for sentence in loops.suspicions)


def test_a_wrong_sign_of_one_signal_is_reported() -> None:
    x = motion()
    loops = analyse_loop(-x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])))
    assert any("sign" in sentence for sentence in loops.suspicions)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_play_is_the_share_of_the_stroke_without_force(share: float) -> None:
    x = motion()
    gap = share * AMPLITUDE
    f = STIFFNESS * np.sign(x) * np.maximum(np.abs(x) - gap, 0.0)
    loops = analyse_loop(x, f)
    # One bin of 2 % and the 3 % of the range that count as no force, on either side.
    assert loops.play == pytest.approx(share, abs=0.06 if share else 0)
    assert any("backlash" in sentence for sentence in loops.suspicions) == (share > 0)


@pytest.mark.parametrize("law", ["spring", "jenkins"])
def test_a_contact_without_play_has_none(law: str) -> None:
    x = motion()
    f = elements(x, np.array([STIFFNESS]), np.array([LIMIT if law == "jenkins" else 1e3]))
    assert analyse_loop(x, f).play == 0


def inside(estimate: Estimate | None, truth: float) -> bool:
    assert estimate is not None
    return estimate.interval[0] <= truth <= estimate.interval[1]


def test_stiffness_and_friction_without_noise_are_exact() -> None:
    x = motion()
    result = estimate_stick_slip(x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])), 10.0)
    assert result.gross_slip
    # Elements of the refined grid are 0.9 % apart, and share the true one: half of that squared, and sampled corners.
    assert result.tangential_stiffness.value == pytest.approx(STIFFNESS, rel=1e-3)
    assert result.friction_coefficient is not None
    assert result.friction_coefficient.value == pytest.approx(LIMIT / 10, rel=1e-3)
    assert inside(result.tangential_stiffness, STIFFNESS)
    assert inside(result.friction_coefficient, LIMIT / 10)


@pytest.mark.parametrize(
    ("n_element", "varying"),
    [(1, False), (12, True), *(pytest.param(*case, marks=slow) for case in ((1, True), (12, False)))],
)
def test_intervals_hold_stiffness_and_friction_of_random_contacts(varying: bool, n_element: int) -> None:
    # 100 of 100 in benchmarks/signal_analysis.py; of 12 with a probability of 0.95, fewer than 9 are 2e-3.
    hits = np.zeros(2)
    for seed in range(12):
        random = np.random.default_rng(10_000 + 100 * n_element + seed)
        slip = AMPLITUDE * random.uniform(0.05, 0.6, n_element)
        stiffness = STIFFNESS * random.dirichlet(np.full(n_element, 2.0))
        x = motion(int(random.integers(3, 10)), int(random.integers(80, 600)), 1.0)
        phase = 2 * np.pi * np.arange(len(x)) / 97 * 0.1 + random.uniform(0, 6)
        normal = 10.0 * (1 + (0.3 * np.cos(phase) if varying else np.zeros(len(x))))
        f = elements(x, stiffness, stiffness * slip * normal[:, None] / 10)
        noise = 10 ** random.uniform(-3.5, -2, 2)
        result = estimate_stick_slip(
            x + noise[0] * AMPLITUDE * random.standard_normal(len(x)),
            f + noise[1] * np.ptp(f) / 2 * random.standard_normal(len(x)),
            normal,
        )
        hits += [
            inside(result.tangential_stiffness, STIFFNESS),
            inside(result.friction_coefficient, float(stiffness @ slip) / 10),
        ]
    assert (hits >= 9).all(), hits


def test_partial_slip_gives_a_lower_bound_of_friction_and_says_so() -> None:
    x = motion()
    stiffness, slip = np.array([1e6, 1e6]), AMPLITUDE * np.array([0.3, 3.0])
    result = estimate_stick_slip(x, elements(x, stiffness, stiffness * slip), 10.0)
    assert not result.gross_slip
    assert inside(result.tangential_stiffness, 2e6)
    assert result.unslipped_stiffness.value == pytest.approx(1e6, rel=0.01)
    assert result.friction_coefficient is not None
    assert result.friction_coefficient.interval[1] == np.inf
    assert result.friction_coefficient.value == pytest.approx((1e6 * 0.3 + 1e6) * AMPLITUDE / 10, rel=0.01)
    assert any("lower bound" in sentence for sentence in result.suspicions)


def test_noise_of_the_normal_force_does_not_soften_the_contact() -> None:
    # Each dip of a noisy limit lets a slider move, and no peak pulls it back: means of the samples are 3 % too soft.
    x = motion(10, 500, 1.0)
    slip = AMPLITUDE * np.linspace(0.02, 0.4, 12)
    f = elements(x, np.full(12, STIFFNESS / 12), STIFFNESS / 12 * slip)
    normal = 10.0 * (1 + 0.02 * np.random.default_rng(1).standard_normal(len(x)))
    result = estimate_stick_slip(x, f, normal)
    # Of 500 samples about one lies within the shortest slip after a reversal.
    assert result.tangential_stiffness.value == pytest.approx(STIFFNESS, rel=0.01)


def test_a_contact_that_opens_keeps_its_stiffness_and_friction() -> None:
    x = motion(10, 500, 1.0)
    turn = 2 * np.pi * np.arange(len(x)) / 500
    normal = 10.0 * np.maximum(1 + 1.5 * np.cos(turn + 1.0), 0.0)
    stiffness, slip = np.array([3e5, 5e5, 2e5]), np.array([2e-7, 5e-7, 9e-7])
    result = estimate_stick_slip(x, elements(x, stiffness, stiffness * slip * normal[:, None]), normal)
    assert result.tangential_stiffness.value == pytest.approx(1e6, rel=0.01)
    assert result.friction_coefficient is not None
    assert result.friction_coefficient.value == pytest.approx(float(stiffness @ slip), rel=0.01)


def test_an_offset_of_the_force_is_not_friction() -> None:
    x = motion()
    f = elements(x, np.array([STIFFNESS]), np.array([LIMIT]))
    result = estimate_stick_slip(x, f + 3.0, 10.0)
    assert inside(result.friction_coefficient, LIMIT / 10)
    assert result.force_offset.value == pytest.approx(3.0, abs=0.01)


def test_a_part_that_slips_at_once_makes_the_stiffness_a_lower_bound() -> None:
    x = motion()
    result = estimate_stick_slip(x, elements(x, np.array([STIFFNESS, 1e12]), np.array([LIMIT, 1.0])), 10.0)
    assert result.tangential_stiffness.interval[1] == np.inf
    assert any("too early" in sentence for sentence in result.suspicions)


@pytest.mark.parametrize(
    ("displacement", "force", "normal", "word"),
    [
        (np.zeros(100), np.ones(100), None, "displacement is 0"),
        (np.arange(100.0), np.arange(100.0), None, "period"),
        (motion(), motion()[:-1], None, "shape"),
        (motion(), motion() * np.nan, None, "not numbers"),
        (motion(), motion(), -3.0, "compression"),
        (motion(), motion(), np.ones(7), "7"),
    ],
)
def test_unusable_loops_are_refused(displacement: Array, force: Array, normal: float | Array | None, word: str) -> None:
    with pytest.raises(CampaignError, match=word):
        estimate_stick_slip(displacement, force, normal)


@pytest.mark.parametrize("seed", range(3))
def test_a_stroke_of_twelve_deviations_of_the_noise_is_a_motion(seed: int) -> None:
    # Ten deviations are asked for. Of white noise the second difference has six times the variance, the third twenty.
    turn = np.arange(8 * 100) / 100
    noise = np.random.default_rng(seed).standard_normal(len(turn))
    result = find_periods(noise - 6 * np.cos(2 * np.pi * turn))
    # Highest points lie amid each period; noise moves them along the flat top, by a tenth of a period or two.
    assert len(result) == 8
    assert result == pytest.approx(50 + 100 * np.arange(8), abs=20)


def test_periods_of_a_dying_motion_are_all_found() -> None:
    # Each is 0.69 of the one before: more than 0.4 of those two before it, less than 0.4 of the third.
    turn = np.arange(6 * 200 + 1) / 200
    result = find_periods(-(0.69**turn) * np.cos(2 * np.pi * turn))
    assert len(result) == 6


def test_a_spring_does_no_work_on_a_motion_that_drifts() -> None:
    turn = np.arange(6 * 200 + 1) / 200
    x = AMPLITUDE * (0.02 * turn - np.cos(2 * np.pi * turn))
    loops = analyse_loop(x, STIFFNESS * x)
    # The trapezoidal rule is exact for a straight line; what is left is round-off of some hundred terms.
    assert np.abs(loops.work).max() < 1e-12 * STIFFNESS * AMPLITUDE**2


def cycles(*amplitudes: float) -> Array:
    """One cycle of each amplitude, from zero to zero."""
    turn = 2 * np.pi * np.arange(500) / 500
    return np.concatenate([amplitude * np.sin(turn) for amplitude in amplitudes])


def test_single_cycles_of_rising_amplitudes_close_at_the_height_at_which_they_began() -> None:
    x = cycles(*AMPLITUDE * np.array([1.0, 1.2, 1.5, 1.9]))
    loops = analyse_loop(x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])))
    # The motion from rest to the first height stands out less than those between later heights.
    assert [plateau.n_period for plateau in loops.plateaus] == [1, 1]
    for plateau, ratio in zip(loops.plateaus, (1.2, 1.5), strict=True):
        # Samples around the return are up to 2 pi / 500 of the next amplitude apart.
        assert plateau.amplitude[0] == pytest.approx(ratio * AMPLITUDE, rel=0.01)
        work = 4 * LIMIT * (ratio * AMPLITUDE - LIMIT / STIFFNESS)
        assert plateau.work[0] == pytest.approx(work, rel=0.01)


def test_a_single_cycle_counts_if_it_closes_beside_those_that_repeat() -> None:
    x = cycles(*AMPLITUDE * np.array([1.0, 1.0, 1.0, 3.0, 2.0, 2.0, 4.0]))
    loops = analyse_loop(x, elements(x, np.array([STIFFNESS]), np.array([LIMIT])))
    assert [(round(plateau.amplitude[0] / AMPLITUDE, 2), plateau.n_period) for plateau in loops.plateaus] == [
        (1.0, 2), (2.0, 1),
    ]  # fmt: skip


def test_a_cycle_of_a_dashpot_that_grows_does_not_close() -> None:
    x = cycles(*AMPLITUDE * np.array([1.0, 1.5, 2.0, 3.0]))
    assert not analyse_loop(x, np.gradient(x)).plateaus


def test_strokes_to_one_side_have_no_middle_in_common() -> None:
    x = np.repeat([1.0, 2.0], 2000) * AMPLITUDE * (1 + np.sin(2 * np.pi * np.arange(4000) / 500))
    loops = analyse_loop(x, STIFFNESS * x)
    assert len(loops.plateaus) == 2
    assert loops.middle == 0
    assert analyse_loop(x[:2000], STIFFNESS * x[:2000]).middle == pytest.approx(AMPLITUDE, rel=1e-3)
