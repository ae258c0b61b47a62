"""The reference campaign: its truth, its tests, and its folder in the form that every command reads."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from pipeline.output import replace_file
from pipeline.parallel import Task, run_parallel
from study.kind.registry import OpenCase
from study.kind.rig.table import make_rig_model
from study.paper.case import PaperCase
from study.paper.parameters import meshed
from study.paper.specimen import find_density, make_specimen
from study.paper.truth import draw_truth, write_truth
from study.paper.virtual_tests import (
    MEASURED,
    TIP,
    InstrumentLoop,
    TestPoints,
    measure_free,
    measure_loops,
    measure_repeat,
)
from study.run_context import RunContext
from transient.virtual_bench.campaign import CampaignLayout, CampaignPoints, write_campaign

#: The curves exclude the differential laser: the paper uses it for loops alone.
CURVES = (TIP,)


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """The campaign that all iterations are compared with.

    Parameters
    ----------
    campaign
        Campaign as any command reads it.
    loops
        Friction loops of the right side at the lowest and the highest level.
    """

    campaign: Campaign
    loops: tuple[InstrumentLoop, ...]


def make_reference(
    case: PaperCase, opened: OpenCase, folder: Path, run: RunContext, *, seed: int, like: int
) -> Reference:
    """Measure a specimen, or find its tests in the store, and write the campaign's folder.

    Parameters
    ----------
    case
        Case of the replay.
    opened
        Case of the rig.
    folder
        Folder of the campaign.
    run
        Store and progress.
    seed, like
        As in `draw_truth`.
    """
    fine = replace(opened, case=meshed(opened.case, case.specimen.size, case.specimen.modes))
    truth = find_density(fine, draw_truth(case, seed, like), run)
    specimen, points = make_specimen(fine, truth, run), _choose_points(case, fine, seed)
    tasks = [
        Task(
            stage=measure_repeat,
            inputs={"specimen": specimen, "points": points, "repeat": number},
            label=f"repeat {number}",
        )
        for number in range(1, points.n_repeat + 1)
    ]
    common = {"specimen": specimen, "points": points}
    tasks += [
        Task(stage=measure_loops, inputs=common, label="loops", weight=0.5),
        Task(stage=measure_free, inputs=common, label="free blade", weight=0.1),
    ]
    *repeats, loops, free = [item.value for item in run_parallel(tasks, run.store, run.progress, "virtual tests")]
    sweeps = [sweep for repeat in repeats for sweep in repeat]
    grid = CampaignPoints(
        levels=points.levels,
        frequencies=[specimen.resonance * share for share in points.shares],
        free_frequencies=[specimen.free_resonance * share for share in points.free_shares],
        n_repeat=points.n_repeat,
    )
    layout = CampaignLayout(title=case.title, sensors=CURVES, lines=MEASURED, direction="y")
    write_campaign(folder, [*sweeps, free], grid, layout)
    _write_loops(folder, loops)
    write_truth(truth, folder)
    return Reference(campaign=read_campaign(folder), loops=loops)


def _choose_points(case: PaperCase, opened: OpenCase, seed: int) -> TestPoints:
    table, rig = case.campaign, make_rig_model(opened.case).rig
    return TestPoints(
        levels=table.levels, shares=table.shares, free_level=table.free_level, free_shares=table.free_shares,
        n_repeat=table.repeats, theta=rig.damper.cone_half_angle, alpha=rig.decoupler.arm_angle,
        laser_angle=table.laser_angle, cell_error=table.cell_error, frequency_error=table.frequency_error, seed=seed,
    )  # fmt: skip


def _write_loops(folder: Path, loops: tuple[InstrumentLoop, ...]) -> None:
    """Write the loops as tables next to the campaign: its manifest has no inclined sensor."""
    for loop in loops:
        time = np.arange(len(loop.displacement)) / len(loop.displacement) / loop.frequency
        columns = np.column_stack([time, 1e6 * loop.displacement, loop.tangential, loop.normal])
        rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in columns)
        replace_file(folder / f"loop_{loop.level:g}N.csv", f"time [s],x [um],T [N],N [N]\n{rows}\n")
