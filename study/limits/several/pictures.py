"""Pictures of the limits of all quantities: of each output, and of the forces of each line."""

import re
from collections.abc import Iterable, Mapping, Sequence

from figure.force_limits import ForceLimits, LineForceLimits
from figure.line_force_bands import LineForceBands
from study.limits.pictures import choose_levels, draw_limits, label_level, make_band, name_levels
from study.limits.result import LimitCurves
from study.limits.several.quantity import Quantity


def draw_several_limits(
    quantities: Sequence[Quantity], curves: Sequence[LimitCurves], title: str, *, in_newtons: bool
) -> dict[str, object]:
    """Make the figures, by name.

    Parameters
    ----------
    quantities, curves
        Quantities and their limits, in the same order.
    title
        Title of the case.
    in_newtons
        Whether levels are forces.
    """
    stems = name_stems(quantities)
    drawn: dict[str, object] = {}
    lines: dict[str, dict[str, LimitCurves]] = {}
    for quantity, item in zip(quantities, curves, strict=True):
        if quantity.output is not None:
            own = draw_limits(item, title, in_newtons=in_newtons)
            drawn |= {f"{name}_{stems[quantity.place]}": result for name, result in own.items()}
        else:
            lines.setdefault(quantity.place, {})[quantity.force] = item
    if len(curves[0].limits.frequency) > 1:
        for line, forces in lines.items():
            drawn[f"limit_forces_{stems[line]}"] = _arrange_over_frequency(line, forces, title, in_newtons=in_newtons)
    elif lines:
        drawn["limit_forces"] = _arrange_over_level(lines, title, in_newtons=in_newtons)
    return drawn


def _arrange_over_frequency(
    line: str, forces: Mapping[str, LimitCurves], title: str, *, in_newtons: bool
) -> LineForceBands:
    bands = {}
    for force, item in forces.items():
        names = name_levels(item, in_newtons=in_newtons)
        bands[force] = [make_band(item, level, f"{force}, {names[level]}") for level in choose_levels(item)]
    return LineForceBands(bands=bands, title=f"{title}: limits of the forces of {line}")


def _arrange_over_level(
    lines: Mapping[str, Mapping[str, LimitCurves]], title: str, *, in_newtons: bool
) -> LineForceLimits:
    """Arrange the limits at one frequency over level, with the lowest and the highest sampled history."""
    panels = [
        ForceLimits(
            line=line, force=force, level=item.limits.level, value=item.value[:, :, 0], sampled=item.sampled[:, :, 0]
        )
        for line, forces in lines.items()
        for force, item in forces.items()
    ]
    frequency = float(next(iter(next(iter(lines.values())).values())).limits.frequency[0])
    return LineForceLimits(
        panels=panels, title=f"{title}: limits of the forces at {frequency:.6g} Hz",
        sampled_label="lowest and highest history", level_label=label_level(in_newtons=in_newtons),
    )  # fmt: skip


def name_stems(quantities: Iterable[Quantity]) -> dict[str, str]:
    """Make a part of a file name for each sensor and line, with underscores for characters that some systems refuse."""
    stems: dict[str, str] = {}
    for name in dict.fromkeys(item.place for item in quantities):
        stem = re.sub(r"[^\w.-]+", "_", name)
        stems[name] = f"{stem}_{len(stems) + 1}" if stem in stems.values() else stem
    return stems
