"""The specimen behind the replay: where it comes from, and what its kinds have."""

import pytest

from casefile.table import load_case
from study.paper.case import PaperCase
from study.paper.truth import LIKE, draw_truth
from study.shipped_cases import PAPER

MISALIGNED = {1: (), 2: ("shift",), 3: ("shift", "inclination")}


@pytest.fixture(scope="module")
def case() -> PaperCase:
    return load_case(PAPER, PaperCase)


@pytest.mark.parametrize("like", LIKE)
def test_a_truth_lies_in_its_intervals_and_equals_no_iteration(case: PaperCase, like: int) -> None:
    for seed in range(20):
        own = draw_truth(case, seed, like).parameters
        for name in ("kt", "kn", "mu", "damping", "root"):
            low, high = getattr(case.truth, name)
            assert low <= getattr(own, name) <= high
        assert all((own.kt, own.kn) != (printed.kt, printed.kn) for printed in (*case.linear, *case.nonlinear))


@pytest.mark.parametrize("like", LIKE)
def test_a_kind_has_the_misalignment_of_its_iteration_and_no_other(case: PaperCase, like: int) -> None:
    own = draw_truth(case, 4, like).parameters
    for what in ("shift", "inclination"):
        for side in ("left", "right"):
            assert bool(getattr(own, f"{what}_{side}")) == (what in MISALIGNED[like])
    assert own.gap_angle == 0


def test_one_seed_gives_one_truth_and_another_seed_another(case: PaperCase) -> None:
    assert draw_truth(case, 7, 3) == draw_truth(case, 7, 3)
    assert draw_truth(case, 7, 3) != draw_truth(case, 8, 3)
