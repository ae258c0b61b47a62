"""Detection thresholds of a test layout: shipped for known layouts, simulated once for others."""

import hashlib
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.threshold.bootstrap import Trial, fit_thresholds
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.threshold.simulation import Simulation
from pipeline.parallel import Task
from pipeline.pool import run_pooled
from pipeline.progress import Progress
from pipeline.store import Store
from pipeline.worker_pool import Workers
from study.case.setup import Setup
from study.diagnose.null_campaign import null_campaign
from study.shipped_cases import CASES

#: Thresholds of shipped layouts: a JSON object, key of the layout to the fields of `Thresholds`.
SHIPPED = CASES / "detection_thresholds.json"


def layout(setup: Setup, campaign: Campaign, candidates: Catalogue) -> dict[str, Any]:
    """Design of a campaign that determines the thresholds: tests, sensors, held-out data, kind of model, candidates.

    Parameters
    ----------
    setup
        The case.
    campaign
        Measurements.
    candidates
        Candidate effects.
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
        "accepted": [item.name for item in setup.calibration_parameters if item.is_of_case],
        "pressed_together": sorted(sorted(group) for group in model.linked_preloads),
        "numerical_error": [
            *(
                float(f"{getattr(setup.budget, name):.4g}")
                for name in (
                    *("frequency", "compliance", "shares"),
                    *(entry for entry in ("model", "damping") if getattr(setup.budget, entry)),
                )
            ),
            [[finer.system.n_dof, len(finer.system.joints), finer.n_harmonic] for finer in setup.budget.refined],
        ],
        "candidates": sorted(candidates.names),
    }


def hash_layout(contents: dict[str, Any]) -> str:
    """Name of a layout in the file of shipped thresholds."""
    return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()[:16]


def simulate_layout_thresholds(
    key: str, simulation: Simulation, effects: Sequence[Effect], n_trial: int, store: Store, progress: Progress,
    workers: Workers = None,
) -> Thresholds:  # fmt: skip
    """Thresholds of a layout, from simulated campaigns without any effect; each is stored and simulated only once.

    Parameters
    ----------
    key
        Name of the layout.
    simulation
        Simulates a campaign of the layout.
    effects
        Candidates.
    n_trial
        Number of campaigns, at least two.
    store
        Store of the campaigns.
    progress
        Shows the time left.
    workers
        Processes [-]; one for each core by default. Or the address of a dask scheduler.
    """
    tasks = [
        Task(
            stage=null_campaign,
            inputs={"layout": key, "seed": seed, "simulation": simulation, "effects": tuple(effects)},
            label=f"without any effect, {seed}",
        )
        for seed in range(n_trial)
    ]
    trials = run_pooled(tasks, n_trial, store, progress, "detection thresholds", workers)
    return fit_thresholds([Trial(seed=int(t["seed"]), gain=t["gain"], misfit=t["misfit"]) for t in trials])


def are_simulated(key: str, n_trial: int, store: Store) -> bool:
    """Whether all campaigns of a layout are stored and intact."""
    # Inputs that the key ignores are arbitrary.
    ignored: dict[str, Any] = {"simulation": None, "effects": ()}
    return all(store.has(null_campaign, key, seed, **ignored) for seed in range(n_trial))


def find_shipped_thresholds(setup: Setup, campaign: Campaign, without: Sequence[str]) -> Thresholds | None:
    """Shipped thresholds of a layout; with None the diagnosis computes them by linear theory.

    Parameters
    ----------
    setup, campaign
        Model and measurements.
    without
        Kinds of effects that are left out.
    """
    shipped: dict[str, Any] = json.loads(SHIPPED.read_text(encoding="utf-8")) if SHIPPED.exists() else {}
    # Fewer candidates have lower thresholds: those of the whole catalogue are conservative.
    for left_out in (without, ()):
        key = hash_layout(layout(setup, campaign, setup.candidates(campaign, left_out)))
        if key in shipped:
            return Thresholds(**shipped[key]["thresholds"])
    return None
