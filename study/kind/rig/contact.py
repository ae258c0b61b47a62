"""Contacts and dead weights of a rig's case, as input of the numerical packages."""

from dataclasses import dataclass
from math import degrees, tan

import numpy as np

from casefile.table import located
from geometry.interface import ContactLine
from geometry.rig import SIDES, Rig, mating_pairs
from reduction.errors import JointError
from reduction.joined_bodies import LinePair
from reduction.line_contact import LineStiffness
from study.case.tables import Case
from study.kind.rig.table import WIDEST_GAP, PairTable, RigTable, SideWeightTable


@dataclass(frozen=True, kw_only=True)
class WirePull:
    """The pull of a wire on a damper.

    Its force [N], its shift along the damper's axis, positive away from the blade [m], and its inclination to +z in the
    plane of y and z, positive towards +y [rad]. The force is distributed over a width of the cylinder around its
    position [m]; None for the whole cylinder.
    """

    force: float
    shift: float
    inclination: float
    width: float | None = None


def make_line_pairs(case: Case[RigTable], rig: Rig) -> list[LinePair]:
    """Make the four pairs of lines with stiffness, friction and gaps, for `reduction.joined_bodies.join_bodies`."""
    result, common = [], case.structure.contact
    for name, pair in mating_pairs(rig).items():
        own: PairTable = getattr(common, name)
        with located(case, "structure", "contact"):
            stiffness = LineStiffness(
                normal=common.kn if own.kn is None else own.kn, tangential=common.kt if own.kt is None else own.kt
            )
        with located(case, "structure", "contact", name):
            gaps = _compute_gaps(own, common.crowning if own.crowning is None else own.crowning, pair.damper_line)
        result.append(
            LinePair(
                name=name,
                body=pair.damper,
                other=pair.other,
                line=pair.damper_line,
                line_set=pair.damper_line.name,
                other_set=pair.other_line.name,
                stiffness=stiffness,
                friction_coefficient=common.mu if own.mu is None else own.mu,
                gaps=gaps,
            )
        )
    return result


def list_dead_weights(case: Case[RigTable]) -> dict[str, WirePull]:
    """List the pull on the damper of each side.

    Raises
    ------
    CaseError
        A wire is outside the damper's cylinder.
    """
    result, table = {}, case.structure
    half = table.damper.damper().cylinder_length / 2
    for side in SIDES:
        own: SideWeightTable = getattr(table.dead_weight, side)
        with located(case, "structure", "dead_weight", side):
            if abs(own.shift) > half:
                raise JointError(
                    f"shift = {1e3 * own.shift:g} mm is outside the damper's cylinder, on which the wire lies: give "
                    f"{-1e3 * half:g} mm to {1e3 * half:g} mm"
                )
        result[side] = WirePull(
            force=table.dead_weight.force if own.force is None else own.force,
            shift=own.shift,
            inclination=own.inclination,
            width=table.dead_weight.width if own.width is None else own.width,
        )
    return result


def _compute_gaps(table: PairTable, crowning: float, line: ContactLine) -> list[float] | None:
    """Gap at each station of the damper's line: a linear part, and a parabola that is zero in the middle [m]."""
    if not (table.uneven or crowning):
        return None
    distance = np.linalg.norm(line.stations - line.stations[0], axis=1)
    along = distance / distance[-1]
    end = table.gap_end or 0.0
    if table.gap_angle is not None:
        end = table.gap_start + tan(table.gap_angle) * float(distance[-1])
        if not 0 <= end <= WIDEST_GAP:
            raise JointError(
                f"gap_angle = {degrees(table.gap_angle):g} deg gives a gap of {1e6 * end:.4g} um at the damper's "
                f"shoulder, {1e6 * table.gap_start:g} um at its end: it must lie between 0 um and "
                f"{1e6 * WIDEST_GAP:g} um"
            )
    straight = table.gap_start + (end - table.gap_start) * along
    return list(map(float, straight + crowning * (2 * along - 1) ** 2))
