"""One campaign without any effect, simulated and diagnosed, as a stage: its result depends on little code."""

from collections.abc import Sequence

from diagnosis.candidate.effect import Effect
from diagnosis.threshold.bootstrap import run_null_trial
from diagnosis.threshold.simulation import Simulation
from pipeline.store import stage


@stage("campaign without any effect", ignore=("simulation", "effects"))
def null_campaign(layout: str, seed: int, simulation: Simulation, effects: Sequence[Effect]) -> dict[str, float]:
    """One campaign of a layout without any effect, diagnosed."""
    del layout
    return vars(run_null_trial(simulation, effects, seed))
