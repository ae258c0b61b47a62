"""Indications of force-displacement loops in comparison with a model."""

from collections.abc import Sequence

import numpy as np

from correlation.data_type.indication import Indication
from correlation.data_type.loop_prediction import predict_curve
from correlation.data_type.measured_loop import MIN_DEVIATION, ForceLoop, Numbers, compute_loop_features, length_unit
from correlation.model import Model
from correlation.signal.loop import analyse_loop
from geometry.plain_number import format_number

#: Number of parts of a stroke to which a displacement is resolved.
SAMPLED = 200
#: Smallest ratio of amplitudes for the growth of work, and smallest ratio of frequencies for a frequency exponent.
MIN_AMPLITUDE_RATIO, MIN_FREQUENCY_RATIO = 1.5, 1.01


def list_loop_indications(model: Model, loops: Sequence[ForceLoop], predicted: Sequence[Numbers]) -> list[Indication]:
    """Play, work per cycle, its growth with the amplitude, and secant stiffness of all loops together.

    Parameters
    ----------
    model
        Model.
    loops
        Measured loops.
    predicted
        Prediction of the features of each loop.
    """
    measured = [compute_loop_features(loop) for loop in loops]
    indications = []
    for kind, words in (("work", "work per cycle"), ("stiffness", "secant stiffness")):
        ratios, values, answers = [], [], []
        for features, numbers in zip(measured, predicted, strict=True):
            for row, label in enumerate(features.label):
                if label.startswith(words):
                    values.append(features.value[row])
                    answers.append(numbers[row])
                    ratios.append((features.value[row] - numbers[row]) / features.deviation[row])
        there = np.isfinite(ratios)
        if there.any():
            # The calibration error is common to all loops: the mean is not more certain than a single loop.
            difference = float(np.mean(np.array(ratios)[there]))
            measured_range, predicted_range = (_describe_range(np.array(item)[there]) for item in (values, answers))
            unit = "J" if kind == "work" else "N/m"
            indications.append(
                Indication(
                    quantity=words, kind=kind, difference=difference, measured=f"is {measured_range} {unit}",
                    predicted=f"{predicted_range} {unit}",
                )
            )  # fmt: skip
    indications += _indicate_growth(loops, predicted)
    dwell = np.array([loop.loops.dwell for loop in loops])
    if np.median(dwell):
        of_model = float(np.median([_predict_dwell(model, loop) for loop in loops]))
        stroke = float(np.median([2 * loop.loops.plateaus[-1].amplitude[0] for loop in loops]))
        least = stroke / SAMPLED / np.sqrt(len(loops))
        scatter = float(np.std(dwell, ddof=1) / np.sqrt(len(dwell))) if len(dwell) > 1 else 0.0
        unit, factor = length_unit(stroke)
        # The work of a cycle is done over the rest of the stroke, in both directions.
        force = [
            loop.loops.plateaus[-1].work[0] / (2 * (2 * loop.loops.plateaus[-1].amplitude[0] - loop.loops.dwell))
            for loop in loops
        ]
        indications.append(
            Indication(
                quantity="force after a reversal", kind="play",
                difference=(float(np.median(dwell)) - of_model) / max(least, scatter),
                measured=f"stays near zero over {factor * float(np.median(dwell)):.2g} {unit}, and resists with "
                f"{format_number(float(np.median(force)), 3)} N on average over the rest of the stroke",
                predicted=f"does so over {factor * of_model:.2g} {unit}",
            )
        )  # fmt: skip
    return indications


def _indicate_growth(loops: Sequence[ForceLoop], predicted: Sequence[Numbers]) -> list[Indication]:
    """Indication of the exponent of the work per cycle over the amplitude: 2 for a linear damper, about 1 for sliding.

    With several frequencies, the frequency has its own exponent. A narrow range of amplitudes gives no indication.
    """
    rows = []
    for loop, numbers in zip(loops, predicted, strict=True):
        per_plateau = len(numbers) // max(len(loop.loops.plateaus), 1)
        for number, plateau in enumerate(loop.loops.plateaus):
            works = plateau.work[0], float(numbers[per_plateau * number])
            if min(works) > 0 and np.isfinite(works).all():
                rows.append((plateau.amplitude[0], loop.frequency, *works))
    if not rows:
        return []
    amplitude, frequency, work, of_model = np.log(np.array(rows)).T
    columns = [np.ones(len(rows)), amplitude, *([frequency] if np.ptp(frequency) > np.log(MIN_FREQUENCY_RATIO) else [])]
    slopes = np.column_stack(columns)
    if (
        len(rows) <= len(columns)
        or np.ptp(amplitude) < np.log(MIN_AMPLITUDE_RATIO)
        or np.linalg.matrix_rank(slopes) < len(columns)
    ):
        return []
    inverse = np.linalg.inv(slopes.T @ slopes)
    measured, model = (inverse @ slopes.T @ item for item in (work, of_model))
    scatter = float(np.sum((work - slopes @ measured) ** 2)) / (len(rows) - len(columns))
    deviation = float(np.sqrt(max(scatter, MIN_DEVIATION**2) * inverse[1, 1]))
    return [
        Indication(
            quantity="work per cycle over the amplitude", kind="slow growth" if measured[1] < 1.5 else "growth",
            difference=float(measured[1] - model[1]) / deviation, measured=f"grows with its power {measured[1]:.2f}",
            predicted=f"with its power {model[1]:.2f}",
        )
    ]  # fmt: skip


def _describe_range(numbers: Numbers) -> str:
    low, high = (format_number(float(item), 3) for item in (numbers.min(), numbers.max()))
    return low if low == high else f"{low} to {high}"


def _predict_dwell(model: Model, loop: ForceLoop) -> float:
    """Displacement after a reversal over which the force of the predicted loop stays near zero [m].

    It is 0 without a steady state.
    """
    curve = predict_curve(model, loop, loop.loops.plateaus[-1])
    return 0.0 if curve is None else analyse_loop(*(np.tile(signal, 3) for signal in curve)).dwell
