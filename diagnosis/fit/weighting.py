"""Covariance for the comparison of measurements with a model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.jump_error import compute_jump_errors, find_other_branch, find_rows_between_jumps
from correlation.metric.outlier import weigh_outliers
from correlation.model import Model
from correlation.noise.error_patterns import ErrorPatterns, compute_moduli
from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.noise.kink import (
    NODE,
    JitterShift,
    Remainder,
    compute_remainder,
    make_curvature_modes,
    make_kink_modes,
)
from correlation.noise.model_error import ModelErrorCovariance
from correlation.noise.nuisance import (
    N_COMMON,
    Budget,
    ModelFeatures,
    Modes,
    make_history_modes,
    make_nuisance_modes,
)
from correlation.noise.scatter import Scatter, estimate_scatter
from correlation.prediction import Prediction, Predictor
from correlation.row_table import RowTable, join_tables
from diagnosis.fit.calibration import Vector
from diagnosis.fit.comparison import EXCLUDED_FACTOR, Comparison
from diagnosis.fit.jitter import list_preload_jitter

#: Number of friction histories drawn for the covariance, and their seed.
DRAWS, SEED = 16, 1
#: Number of histories for a first estimate of the jitter between repeats, with which all histories are then drawn.
FEW_DRAWS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """Measurements, their features, and a predictor of the same points."""

    observed: Observation
    features: FeatureVector
    predictor: Predictor

    @classmethod
    def prepare(cls, observed: Observation, sweeps: tuple[int, ...]) -> "Measured":
        """Prepare measurements with these sweep directions, +1 up and -1 down.

        Raises
        ------
        CampaignError
            There are only amplitudes without a phase, and all of them are noise.
        """
        observed = observed.where(~observed.amplitude_of_noise)
        if not len(observed.points):
            raise CampaignError(
                "no sensor signal exceeds the noise: amplitudes differ between repeats by as much as their own size; "
                "measure at a higher level, or with phases"
            )
        features = FeatureVector.choose(
            observed.points, observed.value, observed.motion & observed.above_noise, observed.phased
        )
        return cls(observed=observed, features=features, predictor=Predictor(points=observed.points, sweeps=sweeps))


def make_comparison(
    measured: Measured,
    model: Model,
    prediction: Prediction,
    budget: Budget,
    refined: Sequence[Model],
    n_draw: int,
    *,
    fitted: bool,
) -> tuple[Comparison, Scatter]:
    """Comparison with noise, jitter, friction histories and numerical error in its covariance, and the jitter.

    Parameters
    ----------
    measured
        Measurements.
    model, prediction
        Model whose modes are taken, and its prediction.
    budget
        Numerical error.
    refined
        Finer models with the parameters of `model`.
    n_draw
        Number of friction histories.
    fitted
        Whether the model is calibrated, so that outliers get less weight.
    """
    return make_comparisons([measured], model, prediction, budget, refined, n_draw, fitted=fitted)[0]


def make_comparisons(
    data_sets: Sequence[Measured],
    model: Model,
    prediction: Prediction,
    budget: Budget,
    refined: Sequence[Model],
    n_draw: int = DRAWS,
    *,
    fitted: bool = True,
    likes: Sequence[Comparison] | None = None,
    predictor: Predictor | None = None,
) -> list[tuple[Comparison, Scatter]]:
    """`make_comparison` for several sets of measurements of one campaign, such as training and held-out data.

    Each changed model is solved once for all sets. The draws of preloads, and the shifts of repeats that locate kinks,
    are those of the first set.

    Parameters
    ----------
    data_sets
        Sets of measurements.
    prediction
        Prediction at the points of all sets, see `join_measured`.
    model, budget, refined, n_draw, fitted
        As for `make_comparison`.
    likes
        Other comparisons of the same sets, whose outliers are used instead.
    predictor
        Predictor of all sets, with the data of the model that `Predictor.share` keeps; created by default.
    """
    together = join_measured(data_sets)
    predictor = together.predictor.share(model) if predictor is None else predictor
    nominal = ModelFeatures(predictor, together.features, model, prediction)
    rows = _split_rows(data_sets, together.features)
    repeats, errors = make_nuisance_modes(nominal, budget, refined)

    def estimate(history: Modes) -> list[Scatter]:
        return [
            estimate_scatter(
                data_set.observed, data_set.features, [block[at] for block in repeats], history[at], errors[at]
            )
            for data_set, at in zip(data_sets, rows, strict=True)
        ]

    coarse = nominal.coarse()
    scatters = estimate(make_history_modes(coarse, min(n_draw, FEW_DRAWS), SEED))
    if n_draw > FEW_DRAWS:
        covariance, modes = (scatters[0].jitter[-1], repeats[-1]) if len(repeats) > N_COMMON else (None, None)
        scatters = estimate(make_history_modes(coarse, n_draw, SEED, covariance, modes))
    free = together.features.points.free[together.features.row]
    remainders = [compute_remainder(coarse, shift) for shift in _list_shifts(coarse.model, repeats, scatters[0])]
    # The free structure is linear.
    remainders = [item._replace(kink=np.where(free[:, None], 0.0, item.kink)) for item in remainders]
    return [
        _finish_comparison(
            data_set,
            at,
            scatter,
            remainders,
            take_prediction(prediction, data_sets, number),
            fitted,
            None if likes is None else likes[number],
        )
        for number, (data_set, at, scatter) in enumerate(zip(data_sets, rows, scatters, strict=True))
    ]


def allow_model_error(
    comparison: Comparison, model: Model, prediction: Prediction, usual: float, size: ErrorSize = NO_ERROR
) -> Comparison:
    """Comparison with model error in its covariance.

    Parameters
    ----------
    comparison
        Comparison without model error.
    model, prediction
        Model that determines the patterns of the error, and its prediction.
    usual
        Usual error of readings [-]; zero for no model error.
    size
        Size of the model error.
    """
    if not usual:
        return comparison
    features, measured = comparison.features, comparison.measured
    error = ModelErrorCovariance(
        without=comparison.whitening,
        patterns=ErrorPatterns.at(features, comparison.predictor, model, prediction, measured),
        usual=ErrorSize.usual(usual),
        size=size,
    )
    return _with_error(comparison, error)


def update_model_error(comparison: Comparison, prediction: Prediction) -> Comparison:
    """Comparison with the size of its model error, if it has one, estimated from the difference to a prediction."""
    if comparison.model_error is None:
        return comparison
    return _with_error(comparison, comparison.model_error.estimated(comparison.difference(prediction)))


def resize_model_error(comparison: Comparison, size: ErrorSize) -> Comparison:
    """Comparison with another size of its model error, if it has one."""
    error = comparison.model_error
    return comparison if error is None else _with_error(comparison, replace(error, size=size))


def _with_error(comparison: Comparison, error: ModelErrorCovariance) -> Comparison:
    return replace(comparison, whitening=error.whitening, model_error=error)


def leave_out_model_error(comparison: Comparison) -> Comparison:
    """Comparison with noise and stated errors alone in its covariance."""
    error = comparison.model_error
    return comparison if error is None else replace(comparison, whitening=error.without, model_error=None)


def downweight_between_jumps(comparison: Comparison, prediction: Prediction) -> Comparison:
    """The same with negligible weight between a measured and a predicted jump; their distance is the error."""
    errors = compute_jump_errors(comparison.observed, prediction, comparison.predictor.sweeps)
    return _downweight_rows(comparison, find_rows_between_jumps(comparison.observed, errors))


def downweight_other_branch(comparison: Comparison, prediction: Prediction) -> Comparison:
    """The same with negligible weight for points at which the model is on another branch than the structure."""
    return _downweight_rows(comparison, find_other_branch(comparison.observed, prediction, comparison.predictor.sweeps))


def downweight_higher_levels(comparison: Comparison) -> Comparison:
    """The same with negligible weight for the jointed structure above its lowest level, where it is almost linear."""
    points, row = comparison.features.points, comparison.features.row
    higher = ~points.free & (points.level > points.level[~points.free].min(initial=np.inf))
    return comparison.scale_deviations(np.where(higher[row], EXCLUDED_FACTOR, 1.0))


def _downweight_rows(comparison: Comparison, rows: NDArray[np.bool_]) -> Comparison:
    numbers = rows[comparison.features.row]
    if not numbers.any():
        return comparison
    # A difference in these rows is no model error: even one as large as the reading must have negligible weight.
    moduli = compute_moduli(comparison.features, comparison.measured)
    size = np.maximum(moduli / comparison.whitening.deviation, 1.0)
    return comparison.scale_deviations(np.where(numbers, EXCLUDED_FACTOR * size, 1.0))


def join_measured(data_sets: Sequence[Measured]) -> Measured:
    """All measurements of several sets as one; rows of one point in two sets are two rows."""
    if len(data_sets) == 1:
        return data_sets[0]
    starts = np.cumsum([0, *(len(data_set.features.points) for data_set in data_sets[:-1])])
    columns: dict[str, Any] = {}
    for column in fields(FeatureVector):
        parts = [getattr(data_set.features, column.name) for data_set in data_sets]
        if column.name == "reference":
            parts = [np.where(part >= 0, part + start, part) for part, start in zip(parts, starts, strict=True)]
        columns[column.name] = join_tables(parts) if isinstance(parts[0], RowTable) else np.concatenate(parts)
    features = FeatureVector(**columns)
    observed = join_tables([data_set.observed for data_set in data_sets])
    return Measured(
        observed=observed, features=features, predictor=replace(data_sets[0].predictor, points=features.points)
    )


def take_prediction(prediction: Prediction, data_sets: Sequence[Measured], number: int) -> Prediction:
    """Part of a prediction of joined measurements that belongs to one set."""
    first = sum(len(data_set.features.points) for data_set in data_sets[:number])
    rows = first + np.arange(len(data_sets[number].features.points))
    return prediction.where(rows)


def _split_rows(data_sets: Sequence[Measured], together: FeatureVector) -> list[NDArray[np.int64]]:
    """Indices of the joined features that belong to each set, in the order of the set."""
    ends = np.cumsum([len(data_set.features.points) for data_set in data_sets])
    owner = np.searchsorted(ends, together.row, side="right")
    return [np.flatnonzero(owner == number) for number in range(len(data_sets))]


def _finish_comparison(
    data_set: Measured,
    rows: NDArray[np.int64],
    scatter: Scatter,
    remainders: Sequence[Remainder],
    prediction: Prediction,
    fitted: bool,
    like: Comparison | None,
) -> tuple[Comparison, Scatter]:
    """Comparison of one set with all modes in its covariance, and less weight for outliers of a fitted prediction."""
    n_repeat = float(np.median(data_set.observed.count))
    free = data_set.features.points.free[data_set.features.row]
    curvature = make_curvature_modes([item.smooth[rows] for item in remainders], free, n_repeat)
    kinks = make_kink_modes(
        data_set.features.state, [item.kink[rows] for item in remainders], scatter.whitening.deviation, n_repeat
    )
    comparison = Comparison(
        observed=data_set.observed,
        features=data_set.features,
        measured=data_set.features.of_repeats(data_set.observed.repeat, data_set.observed.taken),
        whitening=scatter.whitening.with_modes(np.column_stack([curvature, kinks])),
        predictor=data_set.predictor,
        noise=scatter.noise,
    )
    comparison = downweight_between_jumps(comparison, prediction)
    if like is not None:
        comparison = comparison.scale_deviations(like.deviation_factor)
    elif fitted:
        comparison = comparison.scale_deviations(weigh_outliers(comparison.features, comparison.residual(prediction)))
    return comparison, scatter._replace(whitening=comparison.whitening)


def _list_shifts(model: Model, repeats: Sequence[Modes], scatter: Scatter) -> list[JitterShift]:
    """Shifts by `NODE` standard deviations: of the frequencies of all tests, and of the largest preload pattern."""
    sizes = [NODE * float(np.sqrt(item[0, 0])) for item in scatter.jitter[:2]]
    change = sum(block[:, 0] * size for block, size in zip(repeats, sizes, strict=False))
    result = [
        _make_shift(
            lambda share: model.with_frequency_shift("jointed", share * sizes[0]).with_frequency_shift(
                "free", share * sizes[1]
            ),
            np.asarray(change),
        )
    ]
    if len(scatter.jitter) > N_COMMON and (patterns := list_preload_jitter(model, scatter.jitter[-1])):
        effect, deviation = max(patterns, key=lambda item: item[1])
        size = NODE * deviation
        along = np.array([dict(effect.shares)[group[0]] for group in model.preload_groups])
        result.append(_make_shift(lambda share: effect.apply(model, [share * size]), repeats[-1] @ along * size))
    return result


def _make_shift(shifted: Callable[[float], Model], change: Vector) -> JitterShift:
    """Shift of a model, given by the models at its ends and halves."""
    return JitterShift(models=(shifted(1.0), shifted(-1.0)), halves=(shifted(0.5), shifted(-0.5)), change=change)
