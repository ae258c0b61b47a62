"""Makes the stranger of a seed: case file, campaign folder and truth."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.case import write_case
from benchmarks.strangers.draw import draw_hidden
from benchmarks.strangers.hidden import Hidden
from benchmarks.strangers.layout import Layout, draw_layout
from benchmarks.strangers.measure import measure
from benchmarks.strangers.response import amplitude
from benchmarks.strangers.signature import Signature
from benchmarks.strangers.specimen import Specimen, hide, make_specimen
from benchmarks.strangers.structure import draw_structure
from correlation.campaign.measurement import Campaign, HeldOut, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from study.case.setup import read_case

#: Entropy of all random streams.
ENTROPY = 20270301
#: Probability that a case refers to its finer mesh.
REFINED = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Stranger:
    """Stranger: paths of case and campaign, and data that only the benchmark has."""

    case: Path
    folder: Path
    plan: Blueprint
    layout: Layout
    model: Model
    hidden: tuple[Hidden, ...]
    specimen: Specimen
    floor: Mapping[str, float]
    """Absolute noise of each sensor [its unit]."""
    truth: Mapping[str, Any]


def make(seed: int, folder: Path) -> Stranger:
    """Make the stranger of a seed in an existing folder.

    Each part has its own random stream, so that a change of one part does not change the others.
    """
    begin = time.process_time()
    streams = [np.random.default_rng(item) for item in np.random.SeedSequence([ENTROPY, seed]).spawn(6)]
    plan = draw_structure(streams[0])
    finer = write_case(plan, folder, "finer", plan.finer)
    refined = ["finer.toml"] if plan.finer > 1 and streams[0].uniform() < REFINED else []
    case = write_case(plan, folder, "case", refined=refined)
    setup = read_case(case).setup
    bare = setup.model
    layout = draw_layout(plan, bare, streams[1])
    sensors = _planned(layout)
    model = with_sensors(bare, sensors)
    stated = replace(setup.budget, refined=[with_sensors(item, sensors) for item in setup.budget.refined])
    droop = {
        grid.name: 1 - layout.droop * _shape(plan, bare, grid.levels[-1], grid.frequencies, grid.configuration)
        for grid in layout.grids
    }
    bare_specimen = make_specimen(with_sensors(read_case(finer).setup.model, sensors), streams[4])
    signature = Signature(plan, layout, model, bare_specimen.factors, droop, stated, streams[2])
    hidden = draw_hidden(plan, layout, model, signature, streams[3])
    planned = time.process_time()
    effects = [effect for effect, _ in hidden]
    specimen = hide(bare_specimen, effects)
    campaign, sweeps = measure(specimen, layout, effects, signature.floor, droop, streams[5])
    write_campaign(campaign, folder / "campaign")
    truth = {
        "seed": seed,
        "structure": {
            "kind": plan.kind, "dofs": bare.system.n_dof, "contacts": plan.n_contact, "lines": list(plan.lines),
            "jenkins": len(plan.jenkins), "cubic": bool(plan.cubic), "dashpots": len(plan.dashpots),
            "ratio": plan.ratio, "refined": bool(refined),
        },
        "layout": {
            "levels": [grid.levels for grid in layout.grids], "frequencies": len(layout.grids[0].frequencies),
            "tests": [grid.name for grid in layout.grids], "repeats": layout.n_repeat, "ways": layout.ways,
            "sensors": [item.name for item in layout.sensors], "quantity": layout.sensors[0].quantity,
            "phase": layout.sensors[0].has_phase, "harmonics": layout.harmonics, "droop": layout.droop,
            "noise": layout.noise, "stated": layout.stated,
        },
        "effects": [
            {"name": item.name, "strength": item.strength, "vanishes": item.vanishes, "known": item.known, "z": z}
            for item, z in hidden
        ],
        "specimen": {**specimen.factors, "modes": specimen.mode_deviation, **asdict(sweeps)},
        "plan_seconds": planned - begin,
        "measure_seconds": time.process_time() - planned,
    }  # fmt: skip
    return Stranger(
        case=case, folder=folder / "campaign", plan=plan, layout=layout, model=model, hidden=tuple(effects),
        specimen=specimen, floor=signature.floor, truth=truth,
    )  # fmt: skip


def _shape(plan: Blueprint, model: Model, level: float, frequencies: tuple[float, ...], configuration: str) -> Any:
    """Response of the drive at a level, relative to its largest value, shape (frequency,)."""
    curve = amplitude(model, plan.drive, [level], frequencies, free=configuration == "free")[0]
    return curve / max(float(curve.max()), 1e-300)


def _planned(layout: Layout) -> Campaign:
    """Campaign of one row, for the placement of the sensors on a model."""
    one = np.ones(1)
    row = Measurement(
        test=0 * one, order=one, repeat=one, sweep=one, level=one, frequency=one, sensor=0 * one,
        harmonic=one * max(layout.harmonics), value=one,
    )  # fmt: skip
    return Campaign(
        title="", folder=Path(), sensors=tuple(replace(item) for item in layout.sensors),
        tests=(Test(name="planned"),), measurement=row, held_out=HeldOut(),
    )  # fmt: skip
