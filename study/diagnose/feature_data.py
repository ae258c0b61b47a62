"""Setup and errors of a case beside data that are compared through features."""

from dataclasses import replace
from math import nan
from pathlib import Path

from correlation.campaign.measurement import Campaign
from correlation.sensor_placement import with_sensors
from diagnosis.fit.problem import Refit
from study.case.setup import Setup, read_case
from study.diagnose.history import Errors
from study.diagnose.round import summarise_errors
from study.run_context import RunContext


def read_setup_with_sensors(case: Path, campaign: Campaign, run: RunContext) -> Setup:
    """Read a case, and add the sensors of the campaign to its model."""
    setup = read_case(case, campaign, run).setup
    return replace(setup, model=with_sensors(setup.model, campaign))


def summarise_feature_errors(refit: Refit) -> Errors:
    """Reduced chi-squared alone: features have errors in standard deviations, not in per cent."""
    return replace(summarise_errors(refit), training=nan, held_out=nan)
