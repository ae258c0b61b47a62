"""What chance may do in tests of one layout: shipped for known layouts, measured once for others."""

import hashlib
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.threshold.bootstrap import Trial, thresholds_from
from diagnosis.threshold.simulation import Simulation
from diagnosis.threshold.thresholds import Thresholds
from pipeline.parallel import Task, run_parallel
from pipeline.progress import Progress
from pipeline.store import Store
from study.case.setup import Setup
from study.diagnose.steps import chance
from study.shipped import CASES

#: Thresholds of shipped layouts: a JSON object, key of the layout to the fields of `Thresholds`.
SHIPPED = CASES / "limits.json"


def layout(setup: Setup, campaign: Campaign, candidates: Catalogue) -> dict[str, Any]:
    """What the limits depend on: tests, sensors, what is held out, the kind of model, the candidates; no values.

    Parameters
    ----------
    setup
        Of the case.
    campaign
        As read.
    candidates
        That take part.
    """
    table, model = campaign.measurement, setup.model
    tests = [
        {
            "configuration": test.configuration,
            "levels": [float(f"{level:.4g}") for level in np.unique(table.level[table.test == number])],
            "n_frequency": len(np.unique(np.round(table.frequency[table.test == number], 6))),
            "repeats": len(np.unique(table.repeat[table.test == number])),
            "sweeps": np.unique(table.sweep[table.test == number]).tolist(),
            "harmonics": np.unique(table.harmonic[table.test == number]).tolist(),
        }
        for number, test in enumerate(campaign.tests)
    ]
    return {
        "tests": tests,
        "sensors": sorted(sensor.name for sensor in campaign.sensors),
        "held_out": [
            [float(f"{level:.4g}") for level in campaign.held_out.levels],
            len(campaign.held_out.repeats),
        ],
        "n_dof": model.system.n_dof,
        "lines": {name: len(members) for name, members in model.lines.items()},
        "accepted": [each.name for each in setup.accepted],
        "pressed_together": sorted(sorted(group) for group in model.pressed_together),
        "numerical_error": [
            *(float(f"{each:.4g}") for each in (setup.budget.frequency, setup.budget.compliance, setup.budget.shares)),
            [[finer.system.n_dof, len(finer.system.joints), finer.n_harmonic] for finer in setup.budget.refined],
        ],
        "candidates": sorted(candidates.names),
    }


def layout_key(of: dict[str, Any]) -> str:
    """Name of a layout in the file of shipped limits."""
    return hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest()[:16]


def shipped_limits(key: str) -> Thresholds | None:
    """Thresholds that come with stickslip; none for a layout that it does not know."""
    try:
        known: dict[str, Any] = json.loads(SHIPPED.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return Thresholds(**known[key]["limits"]) if key in known else None


def measured_limits(
    key: str, simulation: Simulation, effects: Sequence[Effect], n_trial: int, store: Store, progress: Progress
) -> Thresholds:
    """Thresholds of a layout, from campaigns without any effect; each is kept, so that this is done once.

    Parameters
    ----------
    key
        Of the layout.
    simulation
        Of a campaign in it.
    effects
        Candidates.
    n_trial
        Campaigns, two at least.
    store
        Where each is kept.
    progress
        Shows the time left.
    """
    tasks = [
        Task(
            stage=chance,
            inputs={"layout": key, "seed": seed, "simulation": simulation, "effects": tuple(effects)},
            label=f"without any effect, {seed}",
        )
        for seed in range(n_trial)
    ]
    found = [outcome.value for outcome in run_parallel(tasks, store, progress, "what chance does in this layout")]
    trials = [Trial(seed=int(each["seed"]), gain=each["gain"], misfit=each["misfit"]) for each in found]
    return thresholds_from(trials)


def is_measured(key: str, n_trial: int, store: Store) -> bool:
    """Whether all campaigns of a layout are kept, and sound."""
    # What is ignored in the key may be anything.
    ignored: dict[str, Any] = {"simulation": None, "effects": ()}
    return all(store.holds(chance, key, seed, **ignored) for seed in range(n_trial))


def limits_for(setup: Setup, campaign: Campaign, without: Sequence[str]) -> Thresholds | None:
    """Thresholds of a layout; none lets the diagnosis reckon them by the linear theory.

    Parameters
    ----------
    setup, campaign
        Model and measurements.
    without
        Kinds that are left out.
    """

    def known(left_out: Sequence[str]) -> Thresholds | None:
        return shipped_limits(layout_key(layout(setup, campaign, setup.candidates(campaign, left_out))))

    # With fewer candidates chance does less: the limits of the whole catalogue are on the safe side.
    return known(without) or known(())
