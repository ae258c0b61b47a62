"""What `stickslip solve` says of amplitudes that harmonics and samples leave inaccurate."""

from collections.abc import Sequence

import numpy as np

from geometry.plain_number import format_number
from study.solve.model import SolveModel
from study.solve.result import SolvedCurve, find_main_harmonic

#: An amplitude whose estimated error is larger than this is not to be used unawares: the error itself may be three
#: times its estimate (`hbsolve.refinement.MARGIN`).
MOST_ERROR = 0.01


def describe_error_warning(curves: Sequence[SolvedCurve], model: SolveModel) -> str:
    """One sentence on the amplitude whose estimated error is too large, empty if there is none.

    It names the output and the curve whose error at the highest point is the largest. If the errors at all highest
    points are small, it names those with the largest share of points whose error is not.
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
    """The error of a point in words; beyond the amplitude itself an estimate says no more than that."""
    error = float(errors[point])
    size = "more than 100 %" if error > 1 else f"{format_number(100 * error)} %"
    where = f"{item.branch.frequency[point]:.5g} Hz"
    return f"{size} at {where}" if item.curve.parameter == "frequency" else f"{size} at level {item.level[point]:.4g}"
