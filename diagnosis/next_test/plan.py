"""Plan: visible effects of planned tests, their smallest detectable strengths, and effects that would be confused.

The readings are those of the model. The linear screening of a diagnosis (`diagnosis.screening`) gives the change by
each effect in units of the planned errors, with the calibration parameters projected out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.model import Model, Sensor
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import ErrorSize
from correlation.noise.nuisance import Budget
from correlation.prediction import Predictor
from correlation.row_table import join_tables
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect, EffectError
from diagnosis.decision.verdict import compute_detectable_strengths
from diagnosis.fit.arrangement import make_unknowns
from diagnosis.fit.calibration import Fit, invert_curvature
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.problem import EffectSelection
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.planned_errors import list_usual_jitter, plan_errors
from diagnosis.next_test.planned_noise import PlannedNoise
from diagnosis.screening import Score, screen
from diagnosis.threshold.detection_threshold import compute_linear_thresholds

#: |cos| between the changes by two effects above which tests confuse them [-].
CONFUSED = 0.95


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Effects that are visible in planned tests.

    Parameters
    ----------
    scores
        Effects, those with the largest change by their typical strength first.
    threshold
        Fall of chi^2 above which an effect is named [-].
    catalogue
        All effects, and those that cannot be tested.
    n_number
        Number of compared values [-].
    """

    scores: tuple[Score, ...]
    threshold: float
    catalogue: Catalogue
    n_number: int

    @property
    def seen(self) -> tuple[Score, ...]:
        """Effects that change the readings at all."""
        return tuple(score for score in self.scores if score.size > 0)

    @property
    def detectable(self) -> dict[str, float]:
        """Strength from the neutral value at which each effect is expected to be named, by name [its unit]."""
        return compute_detectable_strengths(self.scores, self.threshold)

    def relative(self, score: Score) -> float:
        """Smallest detectable strength over the typical one [-]."""
        return float(np.sqrt(self.threshold) / score.size) if score.size else np.inf

    @cached_property
    def cosines(self) -> Float[NDArray[np.float64], "n n"]:
        """|cos| of the changes by each pair of `seen`, shape (n, n) [-]."""
        directions = np.array([score.direction for score in self.seen]).reshape(len(self.seen), -1)
        return np.asarray(np.abs(directions @ directions.T))

    def confused_with(self, score: Score) -> list[str]:
        """Names of effects that these tests could not distinguish from the given one, most similar first."""
        names = [item.effect.name for item in self.seen]
        if score.effect.name not in names:
            return []
        own = names.index(score.effect.name)
        ranked = np.argsort(-self.cosines[own]).tolist()
        return [names[item] for item in ranked if item != own and self.cosines[own, item] > CONFUSED]


def plan_tests(
    tests: Sequence[NextTest], model: Model, calibration: Sequence[CalibrationParameter], budget: Budget,
    noise: PlannedNoise, catalogue: Catalogue,
) -> Plan:  # fmt: skip
    """Plan tests of a model.

    Parameters
    ----------
    tests
        Tests, with equal repeats and sweeps.
    model
        Model with the sensors of the tests, and with added effects.
    calibration
        Calibration parameters.
    budget
        Numerical error of the model; its usual model error is expected.
    noise
        Noise of the sensors.
    catalogue
        Effects of the model.

    Raises
    ------
    EffectError
        The model has no steady state in any of the tests.
    """
    problem = _Planned.make(tests, model, calibration, budget, noise)
    scores = screen(problem, catalogue.candidates)
    ranked = sorted(scores, key=lambda score: -score.size)
    return Plan(
        scores=tuple(ranked), threshold=compute_linear_thresholds(scores).gain, catalogue=catalogue,
        n_number=problem.fit.n_number,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Planned:
    """Planned readings, and the model that predicts them: a problem for the screening."""

    base: Model
    calibration: tuple[CalibrationParameter, ...]
    train: Comparison
    fit: Fit

    selection: ClassVar[EffectSelection] = EffectSelection()

    @classmethod
    def make(
        cls, tests: Sequence[NextTest], model: Model, calibration: Sequence[CalibrationParameter], budget: Budget,
        noise: PlannedNoise,
    ) -> "_Planned":  # fmt: skip
        points = join_tables([test.make_points() for test in tests])
        sweeps, n_repeat = tests[0].sweeps, tests[0].n_repeat
        predictor = Predictor(points=points, sweeps=sweeps)
        unknowns = make_unknowns(model, calibration, ())
        prediction = predictor.predict(model)
        there = np.isfinite(prediction.value) & (prediction.value != 0)
        if not there.any():
            raise EffectError("the model has no steady state at the planned levels and frequencies: plan others")
        prediction = prediction.where(there)
        points, value = prediction.points, prediction.value
        predictor = replace(predictor, points=points)
        cells = [item.name for item in model.sensors if not isinstance(item, Sensor)]
        motion = ~np.isin(points.sensor, cells)
        features = FeatureVector.choose(points, value, motion)
        errors = plan_errors(predictor, model, prediction, list_usual_jitter(model), budget, noise)
        whitening = errors.make_whitening(features, value, np.arange(len(points)), n_repeat, max(len(sweeps), 1))
        measured = features.of_values(value)
        if budget.model:
            patterns = ErrorPatterns.at(features, predictor, model, prediction, measured)
            whitening = patterns.widen(whitening, ErrorSize.usual(budget.model))
        every = np.ones((len(points), 1), dtype=np.bool_)
        train = Comparison(
            observed=Observation(points=points, repeat=value[:, None], motion=motion, taken=every), features=features,
            measured=measured, whitening=whitening, predictor=predictor, noise=whitening.deviation,
        )  # fmt: skip
        values = unknowns.vanishing
        jacobian = np.concatenate(
            [train.slopes(unknowns, values, model, prediction), np.diag(1 / unknowns.prior)], axis=0
        )
        fit = Fit(
            unknowns=unknowns, values=values, chi2=0.0, model=model, prediction=prediction,
            covariance=unknowns.limited(invert_curvature(jacobian, unknowns.size)),
            residual=np.zeros(len(jacobian)), jacobian=jacobian,
        )  # fmt: skip
        return cls(base=model, calibration=tuple(calibration), train=train, fit=fit)

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters, then effects."""
        return make_unknowns(self.base, self.calibration, effects)
