"""Warning of `stickslip solve` about amplitudes that are inaccurate because of too few harmonics or samples."""

from collections.abc import Sequence

import numpy as np

from geometry.plain_number import format_number
from study.solve.model import SolveModel
from study.solve.result import SolvedCurve, find_main_harmonic

#: Largest estimated error of an amplitude without a warning [-]; the error itself may be three times its estimate
#: (`hbsolve.refinement.MARGIN`).
MOST_ERROR = 0.01


def describe_error_warning(curves: Sequence[SolvedCurve], model: SolveModel) -> str:
    """Describe the amplitude with the largest estimated error in one sentence; empty if all errors are small.

    The sentence names the output and the curve with the largest error at the highest point. If the errors at all
    highest points are small, it names those with the largest fraction of points with large errors.
    """
    limit, harmonic = model.tolerance or MOST_ERROR, find_main_harmonic(model.system)
    wrong = []
    for item in curves:
        for output in model.outputs:
            errors, peak = item.output_error(output), item.peak(output, harmonic)
            beyond = errors > limit
            if beyond.any():
                wrong.append((max(float(errors[peak]), limit), float(beyond.mean()), item, output, errors, peak))
    if not wrong:
        return ""
    _, _, item, output, errors, peak = max(wrong, key=lambda entry: entry[:2])
    worst, count = int(np.argmax(errors)), int(np.sum(errors > limit))
    several = len({id(entry[2]) for entry in wrong})
    others = f" (and on {several - 1} other curves)" if several > 1 else ""
    key = "highest" if model.tolerance is None else "highest or tolerance"
    advice = "" if model.tolerance is not None else ", or give a tolerance there"
    return (
        f'{output.name} on the curve "{item.curve.label}"{others}: the truncation of harmonics and samples causes an '
        f"amplitude error of about {_at(item, errors, peak)}, the highest point, and of {_at(item, errors, worst)}; "
        f"it is above {format_number(100 * limit)} % at {count} of {len(errors)} points: raise {key} of [harmonics], "
        f"now highest = {model.harmonics}{advice}"
    )


def _at(item: SolvedCurve, errors: np.ndarray[tuple[int], np.dtype[np.float64]], point: int) -> str:
    """Format the error at a point; an estimate above the amplitude itself is only given as more than 100 %."""
    error = float(errors[point])
    size = "more than 100 %" if error > 1 else f"{format_number(100 * error)} %"
    where = f"{item.branch.frequency[point]:.5g} Hz"
    return f"{size} at {where}" if item.curve.parameter == "frequency" else f"{size} at level {item.level[point]:.4g}"
