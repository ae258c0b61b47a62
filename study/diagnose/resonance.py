"""Resonances of a diagnosis: frequency and damping of every level, measured and by each stage of the model."""

from collections.abc import Iterator, Sequence
from typing import Any

from correlation.metric.peak_error import PeakError
from diagnosis.decision.verdict import Finding
from study.compare.backbone import draw_backbones
from study.compare.run import find_peaks
from study.compare.sentence import describe_resonances
from study.diagnose.round import Round
from study.diagnose.stages import FitStage, list_data_sets, list_stages


def find_resonances(result: Round, stage: FitStage) -> tuple[PeakError, ...]:
    """Measured and predicted resonances of all levels at a stage, weighted by noise and stated errors alone."""
    return find_peaks(list_data_sets(result, stage), result.campaign.drive.unit).errors


def draw_resonances(result: Round, stages: Sequence[FitStage]) -> list[dict[str, Any]]:
    """Backbones as plotly figures."""
    peaks = {stage.name: find_resonances(result, stage) for stage in stages}
    return draw_backbones({name: of for name, of in peaks.items() if of}, result.campaign.drive.unit)


def describe_level_dependence(result: Round) -> Iterator[str]:
    """Describe the level dependence of the resonances in sentences, if an unidentified effect is missing."""
    if result.diagnosis.verdict.finding in {Finding.UNKNOWN, Finding.NOT_CLOSE}:
        peaks = find_resonances(result, list_stages(result)[-1])
        if peaks:
            yield from describe_resonances(peaks, result.campaign.drive.unit, agrees=False)
