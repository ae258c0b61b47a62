"""Operating shapes at the resonances of a comparison, with the states of each contact over the period."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.model import Model
from correlation.model_solver import ModelSolver
from correlation.prediction import Prediction
from hbsolve.contact_motion import contact_motion
from hbsolve.state import SteadyState

#: Number of instants of a period at which the states of contacts are shown.
INSTANTS = 24


@dataclass(frozen=True, kw_only=True, eq=False)
class Operation:
    """A steady state.

    Parameters
    ----------
    label
        Level, frequency and configuration.
    motion
        Coefficients of e^{i Omega t} of all coordinates, shape (r,) [m].
    states
        States of each contact at `INSTANTS` instants of the period, by line, shape (contact, instant) [-]: 0 stuck,
        1 slipping, 2 separated; the largest over two tangents.
    """

    label: str
    motion: Complex[NDArray[np.complex128], " r"]
    states: Mapping[str, Int[NDArray[np.int64], "contact instant"]]


def list_operations(model: Model, prediction: Prediction, unit: str) -> list[Operation]:
    """Find the steady state with the largest first harmonic, for each configuration and level.

    Parameters
    ----------
    model
        Compared model.
    prediction
        Prediction with steady states.
    unit
        Unit of the levels.
    """
    highest: dict[tuple[bool, float], tuple[float, SteadyState]] = {}
    for (free, level, frequency), state in prediction.states.items():
        before = highest.get((free, level))
        if before is None or _compute_size(state) > _compute_size(before[1]):
            highest[free, level] = frequency, state
    solvers = {free: ModelSolver.from_model(model, free, None) for free in {key[0] for key in highest}}
    return [
        Operation(
            label=f"{level:g} {unit}, {frequency:.5g} Hz" + (f", {name_configuration(free)}" if free else ""),
            motion=state.coefficients[1],
            states={} if free else _states(model, solvers[free], state),
        )
        for (free, level), (frequency, state) in sorted(highest.items(), key=lambda item: item[0])
    ]


def _compute_size(state: SteadyState) -> float:
    return float(np.linalg.norm(state.coefficients[1]))


def _states(
    model: Model, solver: ModelSolver, state: SteadyState
) -> dict[str, Int[NDArray[np.int64], "contact instant"]]:
    motions = {motion.name: motion for motion in contact_motion(solver.balance, state)}
    instants = np.arange(INSTANTS) * solver.balance.n_sample // INSTANTS
    return {
        line: np.array([motions[name].status.max(axis=0)[instants] for name in members], dtype=np.int64)
        for line, members in model.lines.items()
    }
