"""``stickslip estimate``: reads first estimates from a campaign, and writes them into the case as factors."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.read_campaign import read_campaign
from correlation.sensor_placement import with_sensors
from pipeline.output import replace_file
from study.case.setup import read_case
from study.diagnose.edit import Written, edited
from study.diagnose.history import read_text
from study.estimate.estimate import Estimate, combine, estimate_all
from study.kind.registry import open_case
from study.run_context import RunContext

#: Units that estimates are written in, with their factors from SI.
SHOWN = {"N/m": ("N/um", 1e-6), "N": ("N", 1.0), "-": ("", 1.0)}
WRITTEN = ("kt", "mu", "zeta")


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimated:
    """What the command reports.

    Parameters
    ----------
    title, case
        Title of the case, and its file.
    estimates
        First estimates.
    missing
        What to measure for the others.
    factors
        Factors on the calibration parameters, with half their 95 % intervals.
    written
        Whether they were written into the case.
    """

    title: str
    case: Path
    estimates: tuple[Estimate, ...]
    missing: tuple[str, ...]
    factors: Mapping[str, Written]
    written: bool

    def text(self) -> str:
        """For people."""
        lines = [f"{self.title}: first estimates", ""]
        for item in self.estimates:
            lines.append(f"  {item.parameter} of {item.where}: {format_value(item)}   ({item.source})")
            lines += [f"      {bias}" for bias in item.bias]
        lines += [f"  not estimated: {text}" for text in self.missing]
        if self.factors:
            lines += [
                "",
                "[calibrated]",
                *(f"{name} = {item.value!r}  # +- {item.note}" for name, item in self.factors.items()),
            ]
            note = f"written into {self.case}" if self.written else f"--write puts these lines into {self.case}"
            lines += ["", f"factors on what the case says; {note}"]
        return "\n".join([*lines, ""])

    def document(self) -> dict[str, Any]:
        """The same for ``--json``."""
        return {
            "case": str(self.case),
            "estimates": [
                {
                    "parameter": item.parameter, "where": item.where, "value": item.value, "low": item.low,
                    "high": item.high, "unit": item.unit, "in_case": item.in_case, "source": item.source,
                    "bias": list(item.bias),
                }
                for item in self.estimates
            ],
            "missing": list(self.missing),
            "factors": {name: item.value for name, item in self.factors.items()},
            "written": self.written,
        }  # fmt: skip


def run_estimate(case: Path, folder: Path, run: RunContext, *, write: bool) -> Estimated:
    """Estimate, and write factors into the case if that is wanted.

    Parameters
    ----------
    case, folder
        Case file and campaign.
    run
        Store and progress of the structure.
    write
        Whether the case gets the factors under ``[calibrated]``; comments and layout stay.

    Raises
    ------
    CaseError, CampaignError
        With what is wrong in the case or the campaign.
    """
    opened = open_case(case)
    with run.progress.step("campaign", expected=1):
        campaign = read_campaign(folder)
    setup = read_case(opened, campaign, run).setup
    for suspicion in campaign.suspicions:
        run.warn(str(suspicion))
    model = with_sensors(setup.model, campaign)
    with run.progress.step("estimates", expected=2):
        estimates, missing = estimate_all(campaign, model)
    accepted = {item.name for item in setup.accepted}
    factors = {}
    for name in WRITTEN:
        best = combine(estimates, name)
        if best is not None and name in accepted:
            half = (best.high - best.low) / 2 / best.in_case if np.isfinite(best.high) else np.nan
            note = f"{half:.2g}" if np.isfinite(half) else "a bound"
            factors[name] = Written(float(f"{best.factor:.4g}"), note)
    if write and factors:
        replace_file(case, edited(read_text(case), {}, factors, case.name).encode())
    return Estimated(
        title=setup.title or case.stem, case=case, estimates=estimates, missing=missing, factors=factors,
        written=write and bool(factors),
    )  # fmt: skip


def format_value(item: Estimate) -> str:
    """Value and interval in the unit that people write."""
    unit, factor = SHOWN[item.unit]
    if item.parameter == "zeta":
        unit, factor = "%", 100.0
    ends = [f"{factor * end:.4g}" if np.isfinite(end) else "?" for end in (item.low, item.high)]
    case = f"; the case says {factor * item.in_case:.4g}" if np.isfinite(item.in_case) else ""
    return f"{factor * item.value:.4g} {unit}".strip() + f" ({ends[0]} to {ends[1]}{case})"
