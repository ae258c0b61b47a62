r"""Stepped-sine sweeps of the virtual test bench: steady states by time integration, each started from the last one.

A period of the excitation maps the state z = (q, v, w) at its phase 0 to P(z). The steady state P(z) = z of the
structure is approached by Broyden's method, which starts from the exact monodromy of the beam with sticking contacts,

.. math:: z \leftarrow z + s, \quad J s = -(P(z) - z), \quad J_0 = \mathrm{diag}(e^{A T} - 1, -1), \quad
          J \leftarrow J + \frac{(y - J s) s^T}{s^T s}

y being the change of P(z) - z by s. The iterates are no physical motion, so they must not enter the friction history:
the part of P(z) that belongs to w is replaced by the positions to which the motion of this period moves the sliders of
the *previous point* (`transient.joint_forces.move_sliders`). At the end P(z) = z, because with one tangent a second
period moves them no further, and friction remembers periodic motions alone: an amplitude that grows slowly to its level
at each frequency leaves the same sliders.

Where the search does not converge, it approaches the point from the last one in smaller and smaller steps of frequency
and level. Where that fails too, as beyond a fold, frequency and level are changed slowly and the motion is integrated
until it repeats.

References
----------
Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation 19 (1965).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from reduction.array_type import Array, Matrix, Vector, Whole
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import JointedSystem
from transient.equilibrium import equilibrium
from transient.errors import TransientError
from transient.joint_arrays import make_joint_table
from transient.joint_forces import move_sliders
from transient.rank_one_update import UpdatedFactor
from transient.state import TransientState
from transient.state_transition import ModalStructure, decompose
from transient.stepper import PeriodRecord, Stepper

STEPS_PER_PERIOD = 128
#: Distance to the steady state, relative to the motion, at which a point is taken: a tenth of what noise leaves.
TOLERANCE = 1e-4
#: Periods of a search for a steady state, and of an integration until the motion repeats.
MAX_PERIOD, MAX_WAIT = 80, 2000
#: Numbers of intermediate steps to a point that was not found at once, and periods integrated at each of the smallest
#: steps: a transient of 0.15 % damping decays to a third, so that it hardly moves the sliders.
STEPS, PERIODS_PER_STEP = (2, 4, 8), 100
#: Longest step towards the steady state but the first, as a share of the motion.
LONGEST = 0.5
#: Perturbation of a steady state, as a share of it, and its growth from which on the state is unstable.
PERTURBATION, GROWTH = 1e-3, 10.0

#: Harmonics of motions, of forces, share of slip, periods, whether periodic, sliders: what is known of a point.
Point = tuple[Array, Array, float, int, bool, Vector]


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepReadings:
    """Sensor readings along a sweep."""

    motion: Complex[Array, "p s 2"]
    """Harmonics 1 and 3 of each motion sensor, shape (point, sensor, 2) [m]."""
    force: Complex[Array, "p l 3"]
    """Harmonics 0, 1 and 3 of each line's tangential and normal force (left T, left N, right T, right N), shape
    (point, 4 or 0, 3) [N]."""
    slip_share: Vector
    """Share of the period in which a contact slips, mean over the contacts, shape (point,) [-]."""
    n_period: Whole
    """Periods integrated for each point, shape (point,) [-]."""
    periodic: NDArray[np.bool_]
    """Whether the motion repeated at each point, shape (point,); elsewhere the other arrays contain its last period."""
    slider: Matrix
    """Sliders at phase 0 of each point, shape (point, slider) [m]."""
    final: TransientState
    """The state in which the sweep ended."""

    @classmethod
    def from_points(cls, points: Sequence[Point], final: TransientState) -> "SweepReadings":
        """Readings of points one after the other."""
        motion, force, slip, n_period, periodic, slider = (np.array(column) for column in zip(*points, strict=True))
        return cls(
            motion=motion, force=force, slip_share=slip, n_period=n_period, periodic=periodic, slider=slider,
            final=final,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _InitialGuess:
    """Initial guess of a point: weighted state of the last one, Broyden's correction of J_0, sliders, amplitude."""

    frequency: float
    level: float
    state: Vector
    correction: Matrix
    slider: Vector
    motion: float


class VirtualSweepTest:
    """Stepped-sine test of one specimen with its motion sensors; time steps are prepared once per frequency.

    Parameters
    ----------
    system
        Structure, contacts and then other joints, and loads for a level of 1 N; the first word of a contact's name is
        its line.
    sensors
        Rows of the motion sensors by name, each of shape (r,) [-].
    steps_per_period
        [-].

    Raises
    ------
    TransientError
        A joint with two sliders, such as a contact with two tangents.
    """

    def __init__(
        self, system: JointedSystem, sensors: Mapping[str, Vector], steps_per_period: int = STEPS_PER_PERIOD
    ) -> None:
        self.system = system
        self.steps_per_period = steps_per_period
        self._contacts = list_friction_contacts(system.joints)
        for joint in system.joints:
            if joint.n_slider > 1:
                raise TransientError(
                    f'the bench supports only joints with one slider, but "{joint.name}" has {joint.n_slider}: give '
                    "it one tangent"
                )
        self.structure = structure = _stuck_structure(system)
        self._rows = np.array(list(sensors.values())) @ structure.mode_shapes
        self._lines = _line_sums(system)
        self._rest = equilibrium(structure)
        self._steppers: dict[float, tuple[Stepper, Matrix]] = {}
        frequency = np.sqrt(structure.eigenvalue)
        # Roots of the energies of displacements, velocities and sliders: z is weighted with them.
        self.weight = np.concatenate([frequency, np.ones_like(frequency), np.sqrt(structure.table.slider_stiffness)])
        r = len(frequency)
        generator = np.zeros((2 * r, 2 * r))
        generator[:r, r:] = np.diag(frequency)
        generator[r:, :r] = -np.diag(frequency)
        generator[r:, r:] = -structure.damping
        self._rate, self._vectors = np.linalg.eig(generator)
        self._inverse_vectors = np.linalg.inv(self._vectors)

    def sweep(
        self,
        frequencies: Sequence[float],
        level: float | Sequence[float],
        multipliers: Vector | None = None,
        *,
        start: TransientState | None = None,
        tolerance: float = TOLERANCE,
        n_stability_period: int = 0,
    ) -> SweepReadings:
        """Steady states at one frequency after the other, the first one from rest.

        Parameters
        ----------
        frequencies
            Frequencies in the order of the sweep [Hz].
        level
            Amplitude of the force, one for all points or one per point [N].
        multipliers
            Friction force of each contact at rest as a share of its limit, shape (contact,) [-]; what the preload
            leaves by default.
        start
            State at rest that an earlier load has left, in place of both.
        tolerance
            Tolerance of a steady state, see `TOLERANCE` [-].
        n_stability_period
            Periods after a small perturbation in which a motion must stay near its steady state to count as periodic; 0
            for no such test: unstable steady states then count as well [-].
        """
        stepper = self.stepper(frequencies[0])
        rest = self._rest if multipliers is None else self.random_start(multipliers)
        stepper.place(start or rest)
        n = len(self.weight)
        guess = _InitialGuess(
            frequency=frequencies[0], level=0.0, state=stepper.vector * self.weight, correction=np.zeros((n, n)),
            slider=stepper.state.slider, motion=0.0,
        )  # fmt: skip
        points = []
        for frequency, force in zip(frequencies, np.broadcast_to(level, len(frequencies)).tolist(), strict=True):
            point, guess = self._find_steady_state(frequency, force, guess, tolerance)
            if n_stability_period and point[4] and not self._is_stable(guess, n_stability_period):
                point = (*point[:4], False, point[5])
            points.append(point)
        return SweepReadings.from_points(points, self.stepper(frequencies[-1]).state)

    def stepper(self, frequency: float) -> Stepper:
        """Time stepper of a frequency [Hz]; every call returns the same object."""
        return self._stepper(frequency)[0]

    def _stepper(self, frequency: float) -> tuple[Stepper, Matrix]:
        if frequency not in self._steppers:
            stepper = Stepper(self.structure, 2 * np.pi * frequency, self.steps_per_period, self._rest)
            turn = (self._vectors * np.expm1(self._rate / frequency)) @ self._inverse_vectors
            slope = -np.eye(len(self.weight))
            slope[: len(turn), : len(turn)] = turn.real
            self._steppers[frequency] = stepper, slope
        return self._steppers[frequency]

    def _find_steady_state(
        self, frequency: float, level: float, last: _InitialGuess, tolerance: float
    ) -> tuple[Point, _InitialGuess]:
        """The steady state at a frequency and a level, and the initial guess of the next point."""
        point, result = self._settle(frequency, level, last, tolerance)
        spent = point[3]
        for n_step in STEPS:
            if result is not None:
                break
            result = last
            for between, grown in _intermediate_points(last, frequency, level, n_step):
                point, result = self._settle(between, grown, result, tolerance)
                spent += point[3]
                if result is None:
                    break
        if result is None:
            point, result = self._integrate_until_settled(frequency, level, last, tolerance)
            spent += point[3]
        motion, force, slip, _, periodic, slider = point
        return (motion, force, slip, spent, periodic, slider), result or last

    def _settle(
        self, frequency: float, level: float, guess: _InitialGuess, tolerance: float
    ) -> tuple[Point, _InitialGuess | None]:
        """Result of a search for a steady state, and the initial guess of the next point if it converged."""
        stepper, slope = self._stepper(frequency)
        stepper.level = level
        weight, n = self.weight, 2 * self.system.n_dof
        z, longest = guess.state, np.inf
        last_step, last_change = np.zeros(len(z)), np.zeros(len(z))
        correction = guess.correction.copy()
        jacobian = UpdatedFactor(slope + correction)
        n_period = 0
        while True:
            n_period += 1
            stepper.vector = z / weight
            # Sliders beyond their limits have moved at once.
            z = stepper.vector * weight
            record = stepper.record()
            change = stepper.vector * weight - z
            slider = self._move_sliders(stepper, record, guess.slider)
            change[n:] = slider * weight[n:] - z[n:]
            motion = record.amplitude
            if last_step.any():
                miss = change - last_change - (slope + correction) @ last_step
                correction += np.outer(miss, last_step) / (last_step @ last_step)
                jacobian.update(miss / (last_step @ last_step), last_step)
            step = -jacobian.solve(change)
            length = float(np.linalg.norm(step))
            distance = max(length, float(np.linalg.norm(change))) / motion
            if distance <= tolerance or n_period == MAX_PERIOD:
                break
            if length > longest:
                step *= longest / length
            # The first step is that of the structure before the change; the next ones correct it.
            longest = LONGEST * max(motion, guess.motion)
            last_step, last_change = step, change
            z = z + step
        settled = distance <= tolerance
        point = (*self.read(record), n_period, settled, record.slider[:, 0])
        if not settled:
            return point, None
        return point, _InitialGuess(
            frequency=frequency, level=level, state=z, correction=correction, slider=slider, motion=motion
        )

    def _integrate_until_settled(
        self, frequency: float, level: float, last: _InitialGuess, tolerance: float
    ) -> tuple[Point, _InitialGuess | None]:
        """The motion after a slow change of frequency and level, and the initial guess of the next point."""
        reached = last.state / self.weight
        for between, grown in _intermediate_points(last, frequency, level, STEPS[-1]):
            stepper, _ = self._stepper(between)
            stepper.level, stepper.vector = grown, reached
            for _ in range(PERIODS_PER_STEP):
                stepper.advance()
            reached = stepper.vector
        # A transient decays at least as fast as in the structure alone; its remainder is the sum of all changes.
        decay = -float(np.expm1(self._rate.real.max() / frequency))
        n_period = STEPS[-1] * PERIODS_PER_STEP
        while True:
            n_period += 1
            z = stepper.vector * self.weight
            record = stepper.record()
            motion = record.amplitude
            settled = bool(np.linalg.norm(stepper.vector * self.weight - z) <= tolerance * decay * motion)
            if settled or n_period >= MAX_WAIT:
                break
        point = (*self.read(record), n_period, settled, record.slider[:, 0])
        if not settled:
            return point, None
        return point, replace(
            last, frequency=frequency, level=level, state=z, slider=record.slider[:, 0], motion=motion
        )

    def _is_stable(self, reached: _InitialGuess, n_period: int) -> bool:
        """Whether a steady state is stable: a small perturbation does not grow over some periods."""
        stepper, _ = self._stepper(reached.frequency)
        stepper.level = reached.level
        n = 2 * self.system.n_dof
        push = np.zeros(len(reached.state))
        push[:n] = np.random.default_rng(0).standard_normal(n)
        push *= PERTURBATION * reached.motion / np.linalg.norm(push)
        stepper.vector = (reached.state + push) / self.weight
        for _ in range(n_period):
            stepper.advance()
            away = (stepper.vector * self.weight - reached.state)[:n]
            if np.linalg.norm(away) > GROWTH * PERTURBATION * reached.motion:
                return False
        return True

    def _move_sliders(self, stepper: Stepper, record: PeriodRecord, left: Vector) -> Vector:
        """Sliders of the previous point after a period of this motion."""
        end = self.structure.rows @ stepper.vector[: self.system.n_dof]
        position = np.concatenate([record.displacement.T, end[None]])
        return move_sliders(self.structure.table.packed, position, left, stepper.step)

    def waveforms(self, record: PeriodRecord) -> tuple[Matrix, Matrix]:
        """Motion of each sensor [m] and T and N of each line [N] over a period, shapes (s, t) and (l, t)."""
        return self._rows @ record.modal_displacement.T, self._lines @ record.force

    def read(self, record: PeriodRecord) -> tuple[Array, Array, float]:
        """Sensor readings of a period: one point of `SweepReadings.motion`, `.force` and `.slip_share`."""
        n = self.steps_per_period
        motion, force = (np.fft.rfft(item, axis=1) * (2 / n) for item in self.waveforms(record))
        force[:, 0] /= 2
        return motion[:, [1, 3]], force[:, [0, 1, 3]], self._slip_share(record)

    def _slip_share(self, record: PeriodRecord) -> float:
        count = len(self._contacts)
        if not count:
            return 0.0
        # A slider that moves while its contact is closed; in lift-off it is dragged along without force.
        slider = record.slider[:count]
        moved = np.abs(np.diff(slider, axis=1, append=slider[:, :1]))
        swing = np.ptp(record.displacement[: 2 * count : 2], axis=1, keepdims=True)
        closed = record.force[1 : 2 * count : 2] > 0
        return float(np.mean((moved > 1e-6 * swing) & closed))

    def random_start(self, multipliers: Vector) -> TransientState:
        """The rest, with sliders whose friction forces are these shares of their limits, shape (contact,) [-]."""
        sliders = self._rest.slider.copy()
        for number, (joint, share) in enumerate(zip(self._contacts, multipliers, strict=True)):
            tangential = float(joint.tangents[0] @ self._rest.displacement)
            closing = float(joint.normal @ self._rest.displacement) - joint.gap
            normal = max(joint.preload + joint.normal_stiffness * closing, 0.0)
            sliders[number] = tangential - share * joint.friction_coefficient * normal / joint.tangential_stiffness
        return TransientState(displacement=self._rest.displacement, velocity=self._rest.velocity, slider=sliders)


def _intermediate_points(last: _InitialGuess, frequency: float, level: float, n_step: int) -> list[tuple[float, float]]:
    """Frequencies [Hz] and levels [N] from the last point to this one, included."""
    way = np.linspace((last.frequency, last.level), (frequency, level), n_step + 1)[1:]
    return [(float(between), float(grown)) for between, grown in way]


def _stuck_structure(system: JointedSystem) -> ModalStructure:
    """Modes with sticking joints and a full damping matrix: these joints then move exactly for any step."""
    table = make_joint_table(system)
    sticks = [joint.n_slider > 0 for joint in system.joints for _ in joint.directions]
    offset = np.where(sticks, table.stuck_stiffness, 0.0)
    return replace(decompose(system, table, offset), diagonal=False)


def _line_sums(system: JointedSystem) -> Matrix:
    """Tangential and normal sums over each line, over the directions of all joints, shape (4 or 0, d) [-]."""
    names = [joint.name.split()[0] for joint in list_friction_contacts(system.joints)]
    sums = np.zeros((2 * len(set(names)), sum(len(joint.directions) for joint in system.joints)))
    for row, line in enumerate(dict.fromkeys(names)):
        for contact, name in enumerate(names):
            if name == line:
                sums[2 * row, 2 * contact] = sums[2 * row + 1, 2 * contact + 1] = 1.0
    return sums
