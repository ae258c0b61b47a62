"""What a diagnosis keeps in the store: its steps, and the campaigns that tell what chance does."""

from collections.abc import Callable, Sequence
from typing import Any

from diagnosis.candidate.effect import Effect
from diagnosis.threshold.bootstrap import null_trial
from diagnosis.threshold.simulation import Simulation
from pipeline.store import stage


@stage("step of a diagnosis", ignore=("make",))
def step(key: str, name: str, make: Callable[[], Any]) -> Any:
    """One step of a round; the key holds all that it depends on, code included."""
    del key, name
    return make()


@stage(
    "what chance does",
    ignore=("simulation", "effects"),
)
def chance(layout: str, seed: int, simulation: Simulation, effects: Sequence[Effect]) -> dict[str, float]:
    """One campaign of a layout without any effect, diagnosed."""
    del layout
    return vars(null_trial(simulation, effects, seed))
