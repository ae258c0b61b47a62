r"""Integration of a jointed system over whole periods of its excitation.

The phase of the excitation is that of the system, Re sum f_k e^{i k Omega t}; every run starts at its phase 0 and
lasts whole periods, so that the state at the end can start the next one.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe.blas_threads import on_one_blas_thread
from reduction.array_input import check_whole_number
from reduction.array_type import Matrix, Vector
from reduction.jointed_system import JointedSystem
from transient.errors import TransientError
from transient.state import TransientState
from transient.stepper import JointHistory, Stepper


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion(JointHistory):
    """Motion in the last periods of an integration, and the final state."""

    angular_frequency: float
    """Omega of the excitation [rad/s]."""
    steps_per_period: int
    """[-]."""
    time: Vector
    """Instants since the start of the integration, whole periods without their last instant, shape (t,) [s]."""
    output_displacement: Mapping[str, Vector]
    output_velocity: Mapping[str, Vector]
    """Of the named output rows, each of shape (t,) [m, m/s]."""
    final: TransientState
    """State at the end."""


@on_one_blas_thread
def integrate(
    system: JointedSystem,
    angular_frequency: float,
    n_period: int,
    steps_per_period: int,
    start: TransientState | None = None,
    level: float = 1.0,
    *,
    keep: int | None = None,
    outputs: Mapping[str, Vector] | None = None,
) -> Motion:
    """Integrate over n_period periods of the excitation; second order in the step, exact where no joint acts.

    Parameters
    ----------
    system
        Structure, joints and loads.
    angular_frequency
        Omega [rad/s].
    n_period
        Periods to integrate [-].
    steps_per_period
        Steps of equal length in each [-].
    start
        State at the start; the equilibrium under the static load by default.
    level
        Scale of the harmonic force [-].
    keep
        How many of the last periods the result holds; all by default.
    outputs
        Rows over the degrees of freedom by name, each of shape (r,) [-].

    Raises
    ------
    TransientError
        Numbers out of range, a start of another system, an output row of another size, no equilibrium to start from,
        or a step whose contact forces were not found.
    """
    if check_whole_number(n_period, "n_period", TransientError) < 1:
        raise TransientError(f"n_period = {n_period} must be a whole number of at least 1")
    if keep is not None and not 1 <= check_whole_number(keep, "keep", TransientError) <= n_period:
        raise TransientError(f"keep = {keep} must lie between 1 and n_period = {n_period}")
    stepper = Stepper(system, angular_frequency, steps_per_period, start, level)
    rows = _check_rows(outputs or {}, system.n_dof)
    n_stored = n_period if keep is None else keep
    for _ in range(n_period - n_stored):
        stepper.advance()
    parts: list[dict[str, Matrix]] = []
    matrix = np.array(list(rows.values())).reshape(len(rows), system.n_dof) @ stepper.structure.mode_shapes
    for _ in range(n_stored):
        record = stepper.record()
        seen, rates = matrix @ record.modal_displacement.T, matrix @ record.modal_velocity.T
        parts.append({**record.joints, "outputs": seen, "rates": rates})
    joined = {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}
    first = (n_period - n_stored) * steps_per_period
    return Motion(
        angular_frequency=angular_frequency,
        steps_per_period=steps_per_period,
        time=np.asarray(np.arange(first, n_period * steps_per_period) * stepper.step, dtype=np.float64),
        output_displacement=dict(zip(rows, joined.pop("outputs"), strict=True)),
        output_velocity=dict(zip(rows, joined.pop("rates"), strict=True)),
        final=stepper.state,
        **joined,
    )


def _check_rows(outputs: Mapping[str, Vector], n_dof: int) -> dict[str, Vector]:
    """Rows of the outputs as numbers; refuse (`TransientError`) a row of another size."""
    rows = {name: np.asarray(row, dtype=np.float64) for name, row in outputs.items()}
    for name, row in rows.items():
        if row.shape != (n_dof,):
            raise TransientError(f'the output "{name}" has shape {row.shape}: give ({n_dof},), a row over all DOFs')
    return rows
