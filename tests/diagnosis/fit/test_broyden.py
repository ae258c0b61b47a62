"""Updated Jacobians reach the minimum that exact ones reach; a stale one neither ends a fit early nor is reported."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit import calibration
from diagnosis.fit.calibration import MIN_GAIN, Ending, Search, calibrate, invert_curvature
from diagnosis.fit.fit_parameter import Unknowns

#: Of the numbers of the valley, in standard deviations: a chi^2 of some hundreds at the start.
SCALE = 20.0


@dataclass(frozen=True, kw_only=True)
class Number:
    """An effect that hands its value on."""

    name: str
    parameters: tuple[EffectParameter, ...]

    def apply(self, model: tuple[float, ...], values: Sequence[float]) -> tuple[float, ...]:
        return (*model, *values)


class Valley:
    """Stands in for a comparison: |residual|^2 is a valley that is steep across and bends along y = x^2."""

    def __init__(self, bend: float = 1.0) -> None:
        self.bend, self.n_slope = bend, 0

    search = Search()

    def covariance(self, _: np.ndarray, jacobian: np.ndarray, size: np.ndarray) -> np.ndarray:
        return invert_curvature(jacobian, size)

    def predict(self, model: tuple[float, ...], before: object = None, starts: object = None) -> np.ndarray:
        del before, starts
        return np.array(model)

    def residual(self, at: np.ndarray) -> np.ndarray:
        x, y = at
        # The third number is left whatever the values: the least chi^2 is 9.
        return np.array([SCALE * 5 * (y - self.bend * x**2), SCALE * (1 - x), 3.0])

    def has_prediction(self, prediction: np.ndarray) -> np.ndarray:
        return np.ones(len(prediction) + 1, dtype=bool)

    def slopes(self, unknowns: Unknowns, values: np.ndarray, model: object, prediction: object) -> np.ndarray:
        del unknowns, model, prediction
        self.n_slope += 1
        return self.exact(values)

    def exact(self, values: np.ndarray) -> np.ndarray:
        x, _ = values
        return -SCALE * np.array([[-10 * self.bend * x, 5.0], [-1.0, 0.0], [0.0, 0.0]])


def unknowns(upper: float = 5.0) -> Unknowns:
    def number(name: str, upper: float) -> Number:
        parameter = EffectParameter(name=name, unit="-", lower=-5.0, upper=upper, typical=0.1)
        return Number(name=name, parameters=(parameter,))

    result = Unknowns.from_effects((), [], [number("x", upper), number("y", 5.0)])  # type: ignore[arg-type, list-item]
    # Priors so wide that they say nothing.
    return Unknowns(base=result.base, effects=result.effects, prior=np.array([1e6, 1e6]))


def jacobian(of: Valley, *values: float) -> np.ndarray:
    """Whitened, with the priors' rows below."""
    return np.concatenate([of.exact(np.array(values)), np.eye(2) / 1e6])


START = np.array([-0.5, 0.6])
LEAST = 9.0


def fit(of: Valley, *, start: np.ndarray = START, slopes: np.ndarray | None = None, ending: Ending = Ending.CONFIRMED):
    return calibrate(of, unknowns(), start, slopes=slopes, ending=ending)  # type: ignore[arg-type]


def test_updates_reach_the_minimum_that_exact_jacobians_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    updated, newly = Valley(0.5), Valley(0.5)
    result = fit(updated)
    # Nothing is agreed with any more: each step makes its own Jacobian.
    monkeypatch.setattr(calibration, "MIN_AGREEMENT", np.inf)
    other = fit(newly)
    for item in (result, other):
        # Both end where a step is expected to gain less than `MIN_GAIN`.
        assert item.chi2 == pytest.approx(LEAST, abs=MIN_GAIN)
        np.testing.assert_allclose(item.values, [1.0, 0.5], atol=np.sqrt(MIN_GAIN) * 3 / SCALE)
    assert updated.n_slope < newly.n_slope


def test_a_jacobian_that_sees_nothing_to_gain_does_not_end_a_fit() -> None:
    """One of elsewhere, orthogonal to the residual: no step of it gains anything."""
    of = Valley()
    blind = np.zeros((5, 2))
    blind[2:] = jacobian(of, *START)[2:]
    blind[2] = (40.0, 0.0)
    # Orthogonal to all but the number that cannot be fitted, which here has to be zero.
    of.residual = lambda at: Valley.residual(of, at) * np.array([1.0, 1.0, 0.0])  # type: ignore[method-assign]
    result = fit(of, slopes=blind)
    assert of.n_slope > 0
    assert result.chi2 < MIN_GAIN


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.5, 0.3), (-1.0, 1.0), (2.0, 4.0)])
def test_a_stale_jacobian_does_not_end_a_fit_in_a_curved_valley(at: tuple[float, float]) -> None:
    """That of another point of the valley leads across its bend, where chi^2 rises."""
    of = Valley()
    result = fit(of, slopes=jacobian(of, *at))
    assert result.chi2 == pytest.approx(LEAST, abs=MIN_GAIN)
    np.testing.assert_allclose(result.values, [1.0, 1.0], atol=np.sqrt(MIN_GAIN) * 3 / SCALE)


def test_a_jacobian_of_the_wrong_sign_does_not_end_a_fit() -> None:
    of = Valley()
    wrong = jacobian(of, *START)
    wrong[:3] *= -1
    assert fit(of, slopes=wrong).chi2 == pytest.approx(LEAST, abs=MIN_GAIN)


@pytest.mark.parametrize("most", [2, 30])
def test_a_fit_that_is_asked_to_be_exact_tells_the_jacobian_of_its_end(most: int) -> None:
    of = Valley(0.1)
    of.search = Search(steps=most)
    result = fit(of, ending=Ending.EXACT)
    np.testing.assert_array_equal(result.jacobian, jacobian(of, *result.values))
    np.testing.assert_allclose(result.covariance, np.linalg.inv(result.jacobian.T @ result.jacobian), rtol=1e-9)


def test_a_linear_comparison_needs_no_second_jacobian() -> None:
    """Nothing bends: the first Jacobian is exact, one step is enough, and the update changes nothing."""
    of = Valley(0.0)
    result = fit(of, slopes=jacobian(of, 0.3, 0.2))
    # The step is shortened by Marquardt's first factor of 1e-3; one Jacobian confirms the end.
    assert of.n_slope <= 1
    assert result.chi2 == pytest.approx(LEAST, abs=MIN_GAIN)
    np.testing.assert_allclose(result.jacobian, jacobian(of, 1.0, 0.0), atol=1e-6 * SCALE)


def test_the_update_is_the_least_change_that_explains_the_step() -> None:
    """B' dx = -dr, and B' = B across the step (in units of what matters of each number)."""
    of, before, size = Valley(), np.array([0.2, 0.1]), np.array([0.5, 2.0])
    after = before + np.array([0.1, 0.3])
    ends = [
        calibration._Evaluation(values=item, model=(), prediction=(), residual=of.residual(item), chi2=0.0)  # type: ignore[arg-type]
        for item in (before, after)
    ]
    old = of.exact(before)
    new = calibration._update_jacobian(old, *ends, size)
    moved = after - before
    # Round-off.
    np.testing.assert_allclose(new @ moved, ends[0].residual - ends[1].residual, rtol=1e-12, atol=1e-12)
    across = size * np.array([-moved[1] / size[1], moved[0] / size[0]])
    np.testing.assert_allclose(new @ across, old @ across, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("upper", [0.4, 0.9])
def test_a_bound_holds_with_updates(upper: float) -> None:
    of = Valley()
    result = calibrate(of, unknowns(upper), START)  # type: ignore[arg-type]
    assert result.values[0] == upper
    # The best within the bound: y = x^2 there.
    assert result.chi2 == pytest.approx(LEAST + (SCALE * (1 - upper)) ** 2, abs=MIN_GAIN)


def test_every_step_that_is_told_is_a_fall() -> None:
    told: list[float] = []
    report: Callable[[float], None] = told.append
    calibrate(Valley(), unknowns(), START, report=report)  # type: ignore[arg-type]
    assert len(told) > 2
    assert (np.diff(told) < 0).all()
