"""Limits of several objectives from shared histories are those of each objective's own search."""

from typing import Any

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.search import LimitSettings
from hbsolve.limits.several_limits import SeveralProgress, several_limits
from reduction.jointed_system import JointedSystem
from tests.slow import slow

#: The search of all objectives takes half a minute; `tests/study/test_several_limits_run.py` has closed forms.
pytestmark = slow

OMEGA = 2 * np.pi * 284.0 * np.array([0.97, 0.985, 0.995])
LEVELS = [1.0, 3.0]
SETTINGS = LimitSettings(population=8, sample=10, block=3)


@pytest.fixture(scope="module")
def balance(wedge: JointedSystem) -> HarmonicBalance:
    return HarmonicBalance(system=wedge, n_harmonic=4, n_sample=64)


@pytest.fixture(scope="module")
def objectives(wedge: JointedSystem) -> dict[str, Objective]:
    names = [joint.name for joint in wedge.joints[:2]]
    return {
        "tip": OutputHarmonic(row=0),
        "static T": ContactForceHarmonic(joints=names, direction=0, harmonic=0),
        "dynamic N": ContactForceHarmonic(joints=names, direction=-1, harmonic=1),
    }


@pytest.fixture(scope="module")
def store() -> dict[str, Any]:
    return {}


@pytest.fixture(scope="module")
def shared(
    balance: HarmonicBalance, objectives: dict[str, Objective], store: dict[str, Any]
) -> dict[str, ResponseLimits]:
    problem = limit_problem(balance, objectives["tip"])
    return several_limits(problem, objectives, OMEGA, LEVELS, settings=SETTINGS, store=store)


@pytest.mark.parametrize("name", ["tip", "static T", "dynamic N"])
def test_they_are_the_limits_of_each_objective_alone(
    balance: HarmonicBalance, objectives: dict[str, Objective], shared: dict[str, ResponseLimits], name: str
) -> None:
    alone = response_limits(limit_problem(balance, objectives[name]), OMEGA, LEVELS, settings=SETTINGS)
    size = np.abs(alone.value).max(axis=(0, 2), keepdims=True)
    # Two searches agree to what one leaves to be gained, 0.1 % by the audit of `stickslip limits`.
    np.testing.assert_allclose(shared[name].value / size, alone.value / size, atol=2e-3)


def test_no_sampled_state_lies_outside(shared: dict[str, ResponseLimits]) -> None:
    for limits in shared.values():
        assert (limits.n_sampled == SETTINGS.sample).all()
        slack = 1e-9 * np.abs(limits.value)
        assert (limits.sampled[0] >= limits.lower - slack[0]).all()
        assert (limits.sampled[1] <= limits.upper + slack[1]).all()


def test_what_is_stored_is_not_computed_again(
    balance: HarmonicBalance, objectives: dict[str, Objective], shared: dict[str, ResponseLimits],
    store: dict[str, Any],
) -> None:  # fmt: skip
    seen: list[SeveralProgress] = []
    again = several_limits(
        limit_problem(balance, objectives["tip"]), objectives, OMEGA, LEVELS, settings=SETTINGS, store=store,
        progress=seen.append,
    )  # fmt: skip
    assert all(item.stage.done == item.stage.total for item in seen)
    assert [item.before for item in seen] == sorted(item.before for item in seen)
    for name, limits in again.items():
        np.testing.assert_array_equal(limits.value, shared[name].value)


def test_no_objective_is_refused(balance: HarmonicBalance) -> None:
    problem = limit_problem(balance, OutputHarmonic(row=0))
    with pytest.raises(BalanceError, match="objective"):
        several_limits(problem, {}, OMEGA, LEVELS)


def test_each_level_is_searched_in_its_own_box(balance: HarmonicBalance, objectives: dict[str, Objective]) -> None:
    problem = limit_problem(balance, objectives["tip"])
    radius = problem.box.radius
    reaches = np.array([0.3 * radius, 1.5 * radius])
    both = several_limits(problem.with_reaches(LEVELS, reaches), objectives, OMEGA, LEVELS, settings=SETTINGS)
    for number, reach in enumerate(reaches):
        single = limit_problem(balance, objectives["tip"], reach=reach)
        alone = several_limits(single, objectives, OMEGA, LEVELS[number : number + 1], settings=SETTINGS)
        for name, limits in both.items():
            np.testing.assert_array_equal(limits.reach[number], reach)
            away = np.abs(limits.initial_slider[:, number] - limits.nominal)
            assert (away <= reach * (1 + 1e-12)).all()  # round-off
            size = np.abs(limits.value).max()
            # Two searches agree to what one leaves to be gained, as above.
            np.testing.assert_allclose(limits.value[:, number] / size, alone[name].value[:, 0] / size, atol=2e-3)
