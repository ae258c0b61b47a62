"""Start values and thresholds of the calibration by hand: those of the paper, or of a case of a rig."""

from dataclasses import dataclass

from study.case.tables import Case
from study.kind.rig.table import RigTable
from study.paper.case import CriteriaTable, EffortTable, PaperCase


@dataclass(frozen=True, kw_only=True)
class LinearStart:
    """Where a linear iteration starts.

    Parameters
    ----------
    kt, kn
        Stiffness of each contact line [N/m].
    damping
        Damping ratio [-].
    root
        Stiffness of the springs of the root [N/m]; None for a fixed one.
    """

    kt: float
    kn: float
    damping: float
    root: float | None


@dataclass(frozen=True, kw_only=True)
class ByHandPlan:
    """Starts, thresholds and effort of the calibration by hand.

    Parameters
    ----------
    linear
        Starts of the three linear iterations. The second and the third keep the ratio of kn to kt of their start.
    rotation
        Rotation of the left damper in a fourth nonlinear iteration [rad]; None for no such iteration.
    criteria
        Thresholds of the criteria.
    effort
        Effort of the search for limits and of the parameter fits.
    """

    linear: tuple[LinearStart, LinearStart, LinearStart]
    rotation: float | None
    criteria: CriteriaTable
    effort: EffortTable


def make_paper_plan(case: PaperCase) -> ByHandPlan:
    """The plan with the printed values of the paper."""
    first, second, third = (
        LinearStart(
            kt=row.kt, kn=row.kn, damping=row.damping, root=case.relaxed.root if row.root == "relaxed" else None
        )
        for row in case.linear
    )
    return ByHandPlan(
        linear=(first, second, third), rotation=case.nonlinear[3].gap_angle, criteria=case.criteria, effort=case.effort
    )


def make_case_plan(case: Case[RigTable], paper: PaperCase) -> ByHandPlan:
    """The plan that starts from the values of a case; thresholds and effort are those of the replay."""
    contact, table = case.structure.contact, case.structure
    start = LinearStart(kt=contact.kt, kn=contact.kn, damping=table.damping.ratio, root=table.root.stiffness)
    return ByHandPlan(linear=(start, start, start), rotation=None, criteria=paper.criteria, effort=paper.effort)
