"""Wires of dead weights."""

from correlation.model import Model, Wire
from diagnosis.candidate.effect import Untestable


def list_wires(model: Model, kind: str) -> tuple[dict[str, Wire], list[Untestable]]:
    """Wires by the name of their dead weight, and dead weights without a wire as untestable, with the reason."""
    if not model.dead_weights:
        return {}, [Untestable(name=kind, reason="the model has no dead weights")]
    wires = {name: item.wire for name, item in model.dead_weights.items() if item.wire is not None}
    left = [
        Untestable(name=f"{kind} of {name}", reason="the model does not define how its load changes with its position")
        for name in model.dead_weights
        if name not in wires
    ]
    return wires, left
