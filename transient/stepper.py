"""A system on its way through time, one call per period."""

from dataclasses import dataclass, fields

import numpy as np

from reduction.array_input import check_finite_number, check_real_number, check_whole_number
from reduction.array_type import Matrix, Vector
from reduction.jointed_system import JointedSystem
from transient.equilibrium import equilibrium
from transient.errors import StepError, TransientError
from transient.joint_forces import joint_forces, set_instant_forces
from transient.state import TransientState, check_state
from transient.state_transition import ModalStructure, make_modal_structure, transition
from transient.time_steps import IntegrationState, integrate_steps

NONE = np.zeros((0, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class JointHistory:
    """Motions, forces and sliders of the joints at t instants."""

    displacement: Matrix
    velocity: Matrix
    """Of the directions of all joints in order, tangents before the normal, shape (d, t) [m, m/s]."""
    force: Matrix
    """Of the joints in these directions, shape (d, t) [N]; positive resists a positive displacement."""
    slider: Matrix
    """Positions of the sliders, shape (s, t) [m]."""

    @property
    def joints(self) -> dict[str, Matrix]:
        """These arrays by name."""
        return {item.name: getattr(self, item.name) for item in fields(JointHistory)}


@dataclass(frozen=True, kw_only=True, eq=False)
class PeriodRecord(JointHistory):
    """One period, sampled at the start of each step."""

    modal_displacement: Matrix
    modal_velocity: Matrix
    """Shape (t, r) [m kg^1/2, m kg^1/2 / s]."""

    @property
    def amplitude(self) -> float:
        """Largest norm of the modal velocities, which is the root of the energy; never zero [m kg^1/2 / s]."""
        return max(float(np.linalg.norm(self.modal_velocity, axis=1).max()), np.finfo(float).tiny)


class Stepper:
    """Integrates over whole periods and stores the state between calls.

    Parameters
    ----------
    system
        Structure, joints and loads, or its modal structure where that is known already.
    angular_frequency
        Omega of the excitation [rad/s].
    steps_per_period
        Number of time steps per period, at least 8 [-].
    start
        State at phase 0; the equilibrium under the static load by default.
    level
        Scale of the harmonic force [-].

    Raises
    ------
    TransientError
        A frequency that is not positive, too few steps, or a state that does not fit the system.
    """

    def __init__(
        self,
        system: JointedSystem | ModalStructure,
        angular_frequency: float,
        steps_per_period: int,
        start: TransientState | None = None,
        level: float = 1.0,
    ) -> None:
        omega = check_real_number(angular_frequency, "angular_frequency", TransientError)
        if not (np.isfinite(omega) and omega > 0):
            raise TransientError(f"angular_frequency = {omega} rad/s must be positive and finite")
        steps = check_whole_number(steps_per_period, "steps_per_period", TransientError)
        if steps < 8:
            raise TransientError(f"steps_per_period = {steps} must be a whole number of at least 8")
        self.structure = make_modal_structure(system)
        self.angular_frequency = omega
        self.steps_per_period = steps
        self.level = check_finite_number(level, "level", TransientError)
        self.transition = transition(self.structure, self.angular_frequency, self.steps_per_period)
        self.step = self.transition.step
        self.iterations = 0
        self.place(equilibrium(self.structure) if start is None else start)

    @property
    def state(self) -> TransientState:
        """Present state of the system."""
        r, shapes = self.structure.system.n_dof, self.structure.mode_shapes
        return TransientState(
            displacement=shapes @ self._now.state[:r], velocity=shapes @ self._now.state[r:], slider=self._now.slider
        )

    @property
    def vector(self) -> Vector:
        """Modal displacements, modal velocities and sliders, shape (2r + s,)."""
        return np.concatenate([self._now.state, self._now.slider])

    @vector.setter
    def vector(self, values: Vector) -> None:
        r, shapes = self.structure.system.n_dof, self.structure.mode_shapes
        self.place(
            TransientState(
                displacement=shapes @ values[:r], velocity=shapes @ values[r : 2 * r], slider=values[2 * r :]
            )
        )

    def advance(self, level: Vector | None = None, load: Vector | None = None) -> None:
        """Integrate over one period without a record.

        Parameters
        ----------
        level, load
            Scale of the harmonic force and of the static load in the middle of each step, shape (t,) [-].

        Raises
        ------
        StepError
            Joint forces that were not found within a step.
        """
        self._integrate(NONE, NONE, NONE, level, load)

    def record(self, level: Vector | None = None, load: Vector | None = None) -> PeriodRecord:
        """Integrate over one period and return it; arguments as for `advance`."""
        n, r, table = self.steps_per_period, self.structure.system.n_dof, self.structure.table
        states, forces, sliders = np.empty((n, 2 * r)), np.empty((n, len(table.rows))), np.empty((n, table.n_slider))
        self._integrate(states, forces, sliders, level, load)
        rows = self.transition.rows
        displacement, velocity = (rows @ part.T for part in (states[:, :r], states[:, r:]))
        force = forces.T.copy()
        set_instant_forces(table.instant, table.packed, displacement, velocity, sliders, force)
        return PeriodRecord(
            modal_displacement=states[:, :r],
            modal_velocity=states[:, r:],
            displacement=displacement,
            velocity=velocity,
            force=force,
            slider=sliders.T,
        )

    def place(self, start: TransientState) -> None:
        """Continue from another state at phase 0."""
        structure, table = self.structure, self.structure.table
        check_state(structure.system, start)
        inverse = structure.inverse_shapes
        state = np.concatenate([inverse @ start.displacement, inverse @ start.velocity])
        position, slider, d = table.rows @ start.displacement, start.slider.copy(), len(table.rows)
        end, mean = np.zeros(d), np.zeros(d)
        # A step of no length: sliders move at once where the friction force exceeds its limit.
        joint_forces(table.packed, position, position, slider.copy(), self.step, mean, end, slider)
        self._now = IntegrationState(state, position, slider, end, end - structure.offset * position, np.eye(d))
        terms = np.where(end > 0, table.normal_terms, 0.0)
        round_off = np.abs(self.transition.flexibility) @ terms
        self._scale = float(np.abs(np.concatenate([position, round_off])).max(initial=0.0))

    def _integrate(
        self, states: Matrix, forces: Matrix, sliders: Matrix, level: Vector | None, load: Vector | None
    ) -> None:
        ones = np.ones(self.steps_per_period)
        level, load = self.level * (ones if level is None else level), ones if load is None else load
        failed, self._scale, iterations = integrate_steps(
            self._now, self._scale, self.transition, self.structure.table.packed, level, load, states, forces, sliders
        )
        self.iterations += iterations
        if failed >= 0 or not np.isfinite(self._now.state).all():
            raise StepError(
                f"the joint forces were not found in step {max(failed, 0)} of {self.steps_per_period} of a period: "
                "take more steps per period"
            )
