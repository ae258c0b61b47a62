"""Jitter as numbers that a fit may set: what they apply, and that their priors are the covariance."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.errors import ModelDefinitionError
from correlation.feature.observation import find_sweep_directions, take_training_part
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.fit.jitter import FrequencyShift, PreloadJitter, list_jitter, list_preload_jitter
from diagnosis.fit.weighting import Measured, make_comparison


def test_a_frequency_shift_shifts_its_test_alone(small: Model) -> None:
    effect = FrequencyShift(configuration="free")
    assert effect.name == "frequency of the free test"
    assert effect.apply(small, [2e-3]).frequency_shift == {"free": 2e-3}
    # Shifts add up: a fit may shift what has been shifted before.
    assert effect.apply(effect.apply(small, [2e-3]), [1e-3]).frequency_shift["free"] == pytest.approx(3e-3)
    assert effect.apply(small, [0.0]).frequency_shift.get("jointed", 0.0) == 0


def test_a_preload_pattern_scales_each_line_by_its_share(small: Model) -> None:
    moved = PreloadJitter(shares=(("left", 0.6), ("right", -0.8)), name="one").apply(small, [0.05])
    for line, factor in (("left", 1.03), ("right", 0.96)):
        for name in small.lines[line]:
            assert moved.contact(name).preload == pytest.approx(factor * small.contact(name).preload)
    # Rest stays rest: the static load balances the preloads.
    balance = sum(joint.preload * joint.normal for joint in moved.system.joints)
    np.testing.assert_allclose(moved.system.static, balance, rtol=0, atol=1e-13)


def test_priors_are_the_covariance(small: Model) -> None:
    lines = np.array([[4e-4, 1e-4], [1e-4, 2e-4]])
    result = list_jitter(small, [*(np.array([[size]]) for size in (9e-8, 4e-8, 1e-4, 4e-6)), lines])
    common, patterns = result[:4], result[4:]
    assert [effect.name for effect, _ in common] == [
        f"{what} of the {test} test" for what in ("frequency", "force") for test in ("jointed", "free")
    ]
    assert [deviation for _, deviation in common] == pytest.approx([3e-4, 2e-4, 1e-2, 2e-3])
    covariance = np.zeros((2, 2))
    for effect, deviation in patterns:
        assert isinstance(effect, PreloadJitter)
        assert [line for line, _ in effect.shares] == ["left", "right"]
        share = np.array([share for _, share in effect.shares])
        covariance += deviation**2 * np.outer(share, share)
    # An eigenvalue decomposition put together again.
    np.testing.assert_allclose(covariance, lines, rtol=1e-12)
    assert len({effect.name for effect, _ in result}) == 6


def test_what_does_not_jitter_is_no_number_to_set(small: Model) -> None:
    none = np.zeros((1, 1))
    assert list_jitter(small, [*[none] * 4, np.zeros((2, 2))]) == []
    (only,) = list_jitter(small, [none, np.array([[1e-8]]), none, none, np.zeros((2, 2))])
    assert only[0].name == "frequency of the free test"
    assert list_jitter(small.without_contacts(), [none] * 4) == []


def test_preload_patterns_are_independent(small: Model) -> None:
    """Three lines that differ by 3 % alike, by 2 % against each other and by 1 % in the middle."""
    model = replace(small, lines={**small.lines, "middle": ("left 1",)})
    patterns = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
    sizes = np.array([0.03, 0.02, 0.01])
    result = list_preload_jitter(model, patterns.T * sizes**2 @ patterns)
    assert len({effect.name for effect, _ in result}) == 3
    best_first = sorted(result, key=lambda item: -item[1])
    for (effect, deviation), size, pattern in zip(best_first, sizes, patterns, strict=True):
        # An eigenvalue decomposition: round-off, over the ratio of the eigenvalues and their differences.
        assert deviation == pytest.approx(size, rel=1e-12)
        assert [line for line, _ in effect.shares] == ["left", "right", "middle"]
        share = np.array([share for _, share in effect.shares])
        np.testing.assert_allclose(share * np.sign(share @ pattern), pattern, rtol=0, atol=1e-12)


def test_lines_that_one_screw_presses_differ_by_one_factor(small: Model) -> None:
    model = replace(small, lines={**small.lines, "middle": ("left 1",)}, linked_preloads=(("right", "left"),))
    assert model.preload_groups == (("right", "left"), ("middle",))
    # The two as one, by 3 %, the third by 2 %.
    patterns = {
        round(deviation, 12): {line: abs(share) for line, share in effect.shares}
        for effect, deviation in list_preload_jitter(model, np.diag([9e-4, 4e-4]))
    }
    assert patterns[0.03] == {"right": 1.0, "left": 1.0, "middle": 0.0}
    assert patterns[0.02] == {"right": 0.0, "left": 0.0, "middle": 1.0}


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ((("left", "up"),), '"up" is pressed together with others, but is not a preload of the model: .* left, right'),
        (((),), "a group of preloads that are pressed together is empty: name them, or leave it out"),
        ((("left", "right"), ("left",)), '"left" is pressed together with others twice: name it once'),
    ],
)
def test_what_is_pressed_together_is_a_preload_once(
    small: Model, groups: tuple[tuple[str, ...], ...], message: str
) -> None:
    with pytest.raises(ModelDefinitionError, match=message):
        replace(small, linked_preloads=groups)


def test_a_line_whose_preload_is_always_the_same_has_no_pattern(small: Model) -> None:
    ((effect, deviation),) = list_preload_jitter(small, np.diag([0.0, 9e-4]))
    # Round-off of a root.
    assert deviation == pytest.approx(0.03, rel=1e-14)
    assert [abs(share) for _, share in effect.shares] == [0.0, 1.0]
    assert list_preload_jitter(small, np.zeros((2, 2))) == []


@pytest.mark.parametrize("factors", [[1.0] * 4, [1.0, 1.03, 1.06, 1.1]])
def test_forces_scatter_where_repeats_differ_by_a_factor_alone(
    small: Model, paper: ModuleType, factors: list[float]
) -> None:
    campaign = paper.make_campaign(small, seed=3, held=())
    table = campaign.measurement
    numbers = np.unique(table.repeat, return_inverse=True)[1]
    grown = replace(campaign, measurement=replace(table, value=np.array(factors)[numbers] * table.value))
    measured = Measured.prepare(take_training_part(grown), find_sweep_directions(grown))
    _, seen = make_comparison(measured, small, measured.predictor.predict(small), Budget(), [], 4, fitted=True)
    # In 1 % of campaigns noise alone looks like a force; this one is none of them.
    scatter = np.var(factors, ddof=1)
    assert seen.jitter[2][0, 0] >= scatter
    # Of three degrees of freedom in a variance: chi-square is above 1.0 in 80 %.
    assert seen.jitter[2][0, 0] <= 3.2 * scatter
