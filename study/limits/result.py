"""Limits as people and other programs want them: in the unit of the surface, and as CSV."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Sensor
from hbsolve.continuation.branch import STATES
from hbsolve.limits.result import SIDES, ResponseLimits
from study.limits.curve import LimitSearchResult
from study.limits.model import LimitSearch, choose_bounded_output
from study.limits.refinement import refine_to_tolerance
from study.limits.table import LimitsTable
from study.run_context import RunContext
from study.solve.model import SolveModel
from study.solve.result import SURFACE_UNIT

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitCurves:
    """Limits of what the case asks for; arrays of both sides have the lower limit first.

    Parameters
    ----------
    limits
        Limits in SI units.
    quantity, unit
        Quantity in words, and its unit.
    has_peaks
        Whether a level is summed up by the highest points of both limits, as of an amplitude; a static
        force is summed up by its range.
    order
        Side of `limits` that gives the lower and the upper limit: the largest loss factor gives the lower one.
    value
        Refined limits where the case has a tolerance, shape (2, l, f) [unit].
    sampled
        Lowest and highest sampled state, shape (2, l, f) [unit]; NaN where there is none.
    searched
        Limits with the harmonics of the search, as the sampled states are, shape (2, l, f) [unit].
    """

    limits: ResponseLimits
    quantity: str
    unit: str
    has_peaks: bool
    order: tuple[int, int]
    value: Float[Real, "2 l f"]
    sampled: Float[Real, "2 l f"]
    searched: Float[Real, "2 l f"]

    @property
    def is_refined(self) -> bool:
        """Whether limits were found again with more harmonics."""
        return bool(self.limits.refined_harmonic.any())

    @property
    def label(self) -> str:
        """Label of an axis."""
        return f"{self.quantity} [{self.unit}]"

    @property
    def jump(self) -> Bool[NDArray[np.bool_], "2 l f"]:
        """Whether a point lies on another branch of optima than a neighbour, shape (2, l, f)."""
        return np.asarray(self.limits.jump[[*self.order]])

    @property
    def repaired(self) -> Bool[NDArray[np.bool_], "2 l f"]:
        """Whether a sampled state led to a point, shape (2, l, f)."""
        return np.asarray(self.limits.repaired[[*self.order]])

    @property
    def share(self) -> Float[Real, "2 l f 3"]:
        """Shares of the period in which sliders stick, slip and are separated, shape (2, l, f, 3) [-]."""
        return np.asarray(self.limits.share[[*self.order]])

    def extreme(self, side: int, level: int) -> int | None:
        """Frequency that sums up a limit of a level; None if none was found."""
        values = self.value[side, level]
        if np.isnan(values).all():
            return None
        return int(np.nanargmax(values) if self.has_peaks or side == 1 else np.nanargmin(values))


def name_quantity(table: LimitsTable, output: Sensor | None, motion: str = "") -> str:
    """Words for what a table bounds, as `convert_limits` takes it."""
    if output is None:
        kind = "mean" if table.objective == "static force" else "amplitude"
        return f"{table.direction or 'tangential'} force of {table.contact}, {kind}"
    return f"{motion} {output.quantity} of {output.name}".lstrip()


def convert_own_limits(
    search: LimitSearch, table: LimitsTable, result: LimitSearchResult, model: SolveModel, run: RunContext
) -> LimitCurves:
    """Limits of the one objective of a case, refined to the tolerance of the case; see `convert_limits`."""
    result = replace(result, limits=refine_to_tolerance(search, result.limits, model.tolerance, run))
    output = choose_bounded_output(table, model.outputs)
    return convert_limits(table, output, search.harmonic, result, model.motion_of(output))


def convert_limits(
    table: LimitsTable, output: Sensor | None, harmonic: int, result: LimitSearchResult, motion: str = ""
) -> LimitCurves:
    """Convert the result of a search into the unit of the surface.

    Parameters
    ----------
    table
        Request of the case.
    output
        Sensor whose amplitude it is; None for forces.
    harmonic
        Harmonic of the amplitude [-].
    result
        Result of the search in SI units.
    motion
        "absolute" or "relative" on a shaken base.
    """
    limits = result.limits
    order, value, sampled, unit = (0, 1), limits.best_value, limits.sampled, "N"
    searched = limits.value
    quantity, has_peaks = name_quantity(table, output, motion), table.objective != "static force"
    if output is not None:
        unit, factor = SURFACE_UNIT[output.quantity]
        scale = factor * (harmonic * limits.angular_frequency) ** DERIVATIVE[output.quantity]
        if result.amplitude is None:
            value, sampled, searched = scale * value, scale * sampled, scale * searched
        else:
            order, quantity = (1, 0), f"{quantity} at the extreme loss factor"
            # What was sampled is the loss factor.
            value, sampled = scale * result.amplitude, np.full(value.shape, np.nan)
            searched = value
    return LimitCurves(
        limits=limits, quantity=quantity, unit=unit, has_peaks=has_peaks, order=order, value=value, sampled=sampled,
        searched=searched,
    )  # fmt: skip


def format_limits_csv(curves: LimitCurves) -> str:
    """One line per level and frequency, with what is known about both limits."""
    stream = io.StringIO()
    write = csv.writer(stream, lineterminator="\n").writerow
    columns = [list_columns(curves, side, f" [{curves.unit}]") for side in range(len(SIDES))]
    write(["level", "frequency [Hz]", "sampled states", *(name for item in columns for name in item)])
    for row in list_rows(curves, columns):
        write(row)
    return stream.getvalue()


def list_rows(curves: LimitCurves, columns: Sequence[Mapping[str, NDArray[Any]]]) -> Iterator[list[str]]:
    """Cells of each level and frequency: these, the sampled states, and the columns of both sides."""
    limits = curves.limits
    for level, frequency in np.ndindex(len(limits.level), len(limits.frequency)):
        at = level, frequency
        bounds = [float(column[at]) for item in columns for column in item.values()]
        known = [float(limits.level[level]), float(limits.frequency[frequency]), float(limits.n_sampled[at])]
        yield [f"{value:.10g}" for value in [*known, *bounds]]


def list_columns(curves: LimitCurves, side: int, unit: str) -> dict[str, NDArray[Any]]:
    """Columns of one limit by heading; headings of values end with their unit, such as " [um]"."""
    limits, row, name = curves.limits, curves.order[side], SIDES[side]
    result: dict[str, NDArray[Any]] = {f"{name}{unit}": curves.value[side]}
    if curves.is_refined:
        result |= {
            f"{name} searched{unit}": curves.searched[side],
            f"{name} harmonics": limits.refined_harmonic[row],
            f"{name} estimated error": limits.refined_error[row],
            f"{name} moved": limits.refined_moved[row],
        }
    if row != side:
        result[f"{name} loss factor"] = limits.value[row]
    result |= {
        f"{name} sampled{unit}": curves.sampled[side],
        f"{name} sampled outside": limits.n_outside[row],
        f"{name} repaired": limits.repaired[row],
        f"{name} jump": limits.jump[row],
        f"{name} residual": limits.residual_norm[row],
        f"{name} predicted gain": limits.predicted[row].max(axis=-1),
        f"{name} realised gain": limits.realised[row].max(axis=-1),
        f"{name} starts": limits.starts[row],
        f"{name} spread": limits.spread[row],
        f"{name} sliders with memory": limits.n_undetermined[row],
        f"{name} drift [um]": 1e6 * limits.drift[row],
        f"{name} sliders on the box": limits.on_bound[row],
    }
    return result | {f"{name} {state}": limits.share[row][..., number] for number, state in enumerate(STATES)}
