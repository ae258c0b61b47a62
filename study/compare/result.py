"""Result of a comparison of a model with measurements."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from correlation.campaign.measurement import SWEEPS, Campaign, Suspicion
from correlation.metric.jump_error import JumpError
from correlation.metric.misfit import Misfit
from correlation.metric.peak_error import PeakError
from correlation.model import Model
from correlation.prediction import Prediction
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.fit.calibration_parameter import CalibrationParameter
from fe.notebook import Tabular
from study.compare.data import DataComparison
from study.compare.section.section import Section

if TYPE_CHECKING:
    import pandas

    from study.compare.families import FamilyComparison

#: Sweep of a row of a table; empty if both sweeps agree.
SWEEP_WORDS = SWEEPS | {0: ""}
#: Whitened difference up to which a model agrees with measurements, and from which it clearly does not: the mean square
#: of hundreds of noise values is within 10 % of 1; the covariance itself is estimated from a few repeats.
AGREES, DIFFERS = 1.25, 2.0


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """A calibration parameter after its calibration: a factor on the case's value, and its standard deviation [-]."""

    name: str
    factor: float
    deviation: float

    @property
    def half_interval(self) -> float:
        """Half of its 95 % interval [-]."""
        return TWO_SIDED_95 * self.deviation


def list_calibrated(
    parameters: Iterable[CalibrationParameter], factors: Iterable[float], deviations: Iterable[float]
) -> tuple[Calibrated, ...]:
    """Parameters with their fitted values; values of further unknowns follow theirs and are left out."""
    values = zip(parameters, factors, deviations, strict=False)
    return tuple(Calibrated(name=item.name, factor=float(a), deviation=float(b)) for item, a, b in values)


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparisonResult(Tabular):
    """Comparison of a model with measurements.

    Parameters
    ----------
    title
        Title of the case.
    campaign
        Measured campaign.
    model, prediction
        Model with every sensor of the campaign, and its steady states at the training data.
    train, held_out
        Misfit to the training data, and to the held-out data; None if nothing is held out.
    peaks
        Errors of the resonances, of all modes and levels.
    jumps
        Errors of the frequencies at which a response jumps, of the training data.
    unread
        Reasons why resonances were not read, in words.
    suspicions
        Suspicious data of the campaign.
    calibrated
        Calibration parameters, if they were fitted first.
    data
        Comparison of data of other types.
    sections
        Sections of the page on further results of the command, after those of every comparison.
    files
        Written files.
    families
        Measured families over the limits of all friction histories, if requested.
    """

    title: str
    campaign: Campaign
    model: Model
    prediction: Prediction
    train: Misfit
    held_out: Misfit | None
    peaks: tuple[PeakError, ...]
    jumps: tuple[JumpError, ...]
    unread: tuple[str, ...]
    suspicions: tuple[Suspicion, ...]
    calibrated: tuple[Calibrated, ...] = ()
    data: tuple[DataComparison, ...] = ()
    sections: tuple[Section, ...] = ()
    files: tuple[Path, ...] = ()
    families: "FamilyComparison | None" = None

    def to_pandas(self) -> "pandas.DataFrame":
        """Table with one row per point of the training and held-out data, as of `Misfit.to_pandas`."""
        import pandas

        sets = {"training": self.train} | ({} if self.held_out is None else {"held out": self.held_out})
        return pandas.concat({name: misfit.to_pandas() for name, misfit in sets.items()}, names=["set", "row"])
