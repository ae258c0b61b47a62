"""What a comparison finds: a model beside measurements."""

from dataclasses import dataclass
from pathlib import Path

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.metric.misfit import Misfit
from correlation.metric.peak_error import PeakError
from correlation.model import Model
from correlation.prediction import Prediction
from study.compare.section.section import Section


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """A calibration parameter after its calibration: a factor on the case's value, and its standard deviation [-]."""

    name: str
    factor: float
    deviation: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Compared:
    """A model beside measurements.

    Parameters
    ----------
    title
        Title of the case.
    campaign
        Measured campaign.
    model, prediction
        Model with every sensor of the campaign, and its steady states at the training data.
    train, held_out
        Misfit to the measurements that a model may be fitted to, and to those that test it; none if none is held out.
    peaks
        Errors of the resonances, of all levels.
    suspicions
        Suspicious data of the campaign.
    calibrated
        Calibration parameters, if they were calibrated first.
    sections
        Sections of the page by what the command did besides, after those of every comparison.
    files
        Written ones.
    """

    title: str
    campaign: Campaign
    model: Model
    prediction: Prediction
    train: Misfit
    held_out: Misfit | None
    peaks: tuple[PeakError, ...]
    suspicions: tuple[Suspicion, ...]
    calibrated: tuple[Calibrated, ...] = ()
    sections: tuple[Section, ...] = ()
    files: tuple[Path, ...] = ()
