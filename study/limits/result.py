"""Limits for output: in the units of reports, and as CSV."""

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
from study.solve.result import DISPLAY_UNIT

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitCurves:
    """Limits of one quantity of a case; arrays of both sides have the lower limit first.

    Parameters
    ----------
    limits
        Limits in SI units.
    quantity, unit
        Quantity in words, and its unit.
    has_peaks
        Whether a level is summarised by the highest points of both limits, as for an amplitude; a static force is
        summarised by its range.
    order
        Sides of `limits` with the lower and the upper limit: the largest loss factor gives the lower limit.
    value
        Limits, refined if the case has a tolerance, shape (2, l, f) [unit].
    sampled
        Lowest and highest sampled state, shape (2, l, f) [unit]; NaN if there is none.
    searched
        Limits with the harmonics of the search and of the sampled states, shape (2, l, f) [unit].
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
        """Whether limits were refined by more harmonics."""
        return bool(self.limits.refined_harmonic.any())

    @property
    def label(self) -> str:
        """Label of an axis."""
        return f"{self.quantity} [{self.unit}]"

    @property
    def jump(self) -> Bool[NDArray[np.bool_], "2 l f"]:
        """Whether a point is on another branch of optima than a neighbour, shape (2, l, f)."""
        return np.asarray(self.limits.jump[[*self.order]])

    @property
    def repaired(self) -> Bool[NDArray[np.bool_], "2 l f"]:
        """Whether a point was repaired from a sampled state, shape (2, l, f)."""
        return np.asarray(self.limits.repaired[[*self.order]])

    @property
    def share(self) -> Float[Real, "2 l f 3"]:
        """Fractions of the period in which sliders stick, slip and are separated, shape (2, l, f, 3) [-]."""
        return np.asarray(self.limits.share[[*self.order]])

    def extreme(self, side: int, level: int) -> int | None:
        """Index of the frequency that summarises a limit of a level; None if no limit was found."""
        values = self.value[side, level]
        if np.isnan(values).all():
            return None
        return int(np.nanargmax(values) if self.has_peaks or side == 1 else np.nanargmin(values))


def name_quantity(table: LimitsTable, output: Sensor | None, motion: str = "") -> str:
    """Name the quantity that a table bounds; for the parameters see `convert_limits`."""
    if output is None:
        kind = "mean" if table.objective == "static force" else "amplitude"
        return f"{table.direction or 'tangential'} force of {table.contact}, {kind}"
    return f"{motion} {output.quantity} of {output.name}".lstrip()


def convert_own_limits(
    search: LimitSearch, table: LimitsTable, result: LimitSearchResult, model: SolveModel, run: RunContext
) -> LimitCurves:
    """Refine the limits of the single objective of a case to its tolerance, and convert them; see `convert_limits`."""
    result = replace(result, limits=refine_to_tolerance(search, result.limits, model.tolerance, run))
    output = choose_bounded_output(table, model.outputs)
    return convert_limits(table, output, search.harmonic, result, model.motion_of(output))


def convert_limits(
    table: LimitsTable, output: Sensor | None, harmonic: int, result: LimitSearchResult, motion: str = ""
) -> LimitCurves:
    """Convert the result of a search into the units of reports.

    Parameters
    ----------
    table
        Table [limits] of the case.
    output
        Sensor whose amplitude is bounded; None for forces.
    harmonic
        Harmonic of the amplitude [-].
    result
        Result of the search in SI units.
    motion
        "absolute" or "relative" on a moving base, otherwise empty.
    """
    limits = result.limits
    order, value, sampled, unit = (0, 1), limits.best_value, limits.sampled, "N"
    searched = limits.value
    quantity, has_peaks = name_quantity(table, output, motion), table.objective != "static force"
    if output is not None:
        unit, factor = DISPLAY_UNIT[output.quantity]
        scale = factor * (harmonic * limits.angular_frequency) ** DERIVATIVE[output.quantity]
        if result.amplitude is None:
            value, sampled, searched = scale * value, scale * sampled, scale * searched
        else:
            order, quantity = (1, 0), f"{quantity} at the extreme loss factor"
            # The sampled values are loss factors, not amplitudes.
            value, sampled = scale * result.amplitude, np.full(value.shape, np.nan)
            searched = value
    return LimitCurves(
        limits=limits, quantity=quantity, unit=unit, has_peaks=has_peaks, order=order, value=value, sampled=sampled,
        searched=searched,
    )  # fmt: skip


def format_limits_csv(curves: LimitCurves) -> str:
    """Format the limits as CSV, one line per level and frequency."""
    stream = io.StringIO()
    write = csv.writer(stream, lineterminator="\n").writerow
    columns = [list_columns(curves, side, f" [{curves.unit}]") for side in range(len(SIDES))]
    write(["level", "frequency [Hz]", "sampled states", *(name for item in columns for name in item)])
    for row in list_rows(curves, columns):
        write(row)
    return stream.getvalue()


def list_rows(curves: LimitCurves, columns: Sequence[Mapping[str, NDArray[Any]]]) -> Iterator[list[str]]:
    """Yield the cells of each level and frequency: level, frequency, count of sampled states, columns of both sides."""
    limits = curves.limits
    for level, frequency in np.ndindex(len(limits.level), len(limits.frequency)):
        at = level, frequency
        bounds = [float(column[at]) for item in columns for column in item.values()]
        known = [float(limits.level[level]), float(limits.frequency[frequency]), float(limits.n_sampled[at])]
        yield [f"{value:.10g}" for value in [*known, *bounds]]


def list_columns(curves: LimitCurves, side: int, unit: str) -> dict[str, NDArray[Any]]:
    """List the columns of one limit by heading; headings of values end with `unit`, such as " [um]"."""
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
