"""The case file of the replay: meshes, virtual tests, intervals of the truth, and the values printed in the paper."""

from typing import Annotated, Literal

from pydantic import Field

from casefile.quantity import Angle, Count, Force, Frequency, Length, Ratio, Stiffness
from casefile.table import CaseModel

#: Smallest and largest value.
Ends = Annotated[tuple[float, float], Field(min_length=2, max_length=2)]
Stiffnesses = tuple[Stiffness, Stiffness]
Lengths = tuple[Length, Length]
Angles = tuple[Angle, Angle]
Shares = Annotated[tuple[float, ...], Field(min_length=4)]


class PaperMeshTable(CaseModel):
    """Size of the elements, and fixed-interface modes of all bodies."""

    size: Length
    modes: Count


class CampaignTable(CaseModel):
    """Virtual tests."""

    levels: Annotated[tuple[float, ...], Field(min_length=1)]
    repeats: Count
    shares: Shares
    free_level: Force
    free_shares: Shares
    laser_angle: Angle
    cell_error: Ratio
    frequency_error: Ratio


class EffortTable(CaseModel):
    """Effort of the search for limits and of the parameter fits."""

    frequencies: Count
    population: Count
    samples: Count
    loop_frequencies: Count
    evaluations: Count


class TruthTable(CaseModel):
    """Intervals from which the specimen is drawn."""

    kt: Stiffnesses
    kn: Stiffnesses
    mu: Ends
    damping: tuple[Ratio, Ratio]
    root: Stiffnesses
    root_loss: tuple[Ratio, Ratio]
    free_frequency: tuple[Frequency, Frequency]
    shift_left: Lengths
    shift_right: Lengths
    inclination_left: Angles
    inclination_right: Angles


class RelaxedTable(CaseModel):
    """A root on springs."""

    root: Stiffness


class LinearTable(CaseModel):
    """A row of the paper's Table 2."""

    kt: Stiffness
    kn: Stiffness
    damping: Ratio
    root: Literal["full", "relaxed"]
    free: bool
    stuck: bool


class NonlinearTable(CaseModel):
    """A row of the paper's figure 16."""

    kt: Stiffness
    kn: Stiffness
    mu: float
    shift_left: Length = 0.0
    shift_right: Length = 0.0
    inclination_left: Angle = 0.0
    inclination_right: Angle = 0.0
    gap_angle: Angle = 0.0
    response: bool
    force: bool


class CriteriaTable(CaseModel):
    """Thresholds of the criteria."""

    free_frequency: Ratio
    stuck_frequency: Ratio
    width: Ratio
    coverage: Ratio
    static_normal: Ratio
    static_tangential: Ratio
    dynamic: Ratio


class PaperCase(CaseModel):
    """All inputs of the replay except the rig."""

    title: str
    model: PaperMeshTable
    specimen: PaperMeshTable
    campaign: CampaignTable
    effort: EffortTable
    truth: TruthTable
    relaxed: RelaxedTable
    linear: tuple[LinearTable, LinearTable, LinearTable]
    nonlinear: tuple[NonlinearTable, NonlinearTable, NonlinearTable, NonlinearTable]
    criteria: CriteriaTable
