r"""Integration until the motion repeats: the steady state, with its errors in time step and in decay.

States at the phase 0 of successive periods are compared in the norm of energy,
|z|^2 = sum (v^2 + |lambda| q^2) over the modes + sum k_t w^2 over the sliders, so that the units of the degrees of
freedom do not matter, and relative to the largest velocity of the period. What is left of the transient is estimated
from the change c over one period as c / (1 - rho), rho being the decay a period: the slower one of what was seen and
of the linear structure.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float

from fe.blas_threads import on_one_blas_thread
from reduction.array_input import check_real_number, check_whole_number
from reduction.array_type import Array, Matrix, Real, Vector
from reduction.jointed_system import JointedSystem
from transient.anderson_acceleration import AndersonAcceleration
from transient.errors import StepError, TransientError
from transient.state import TransientState
from transient.state_transition import ModalStructure, make_modal_structure
from transient.stepper import JointHistory, PeriodRecord, Stepper

#: Periods over which the decay is read off.
WINDOW = 20
#: A decay slower than this a period counts as this.
SLOWEST = 0.9999
#: Motions that repeat after up to so many periods are recognised.
N_MULTIPLE = 8
#: A motion repeats after m > 1 periods if the change over m is below this share of the change over one.
DISTINCT = 1e-2


@dataclass(frozen=True, kw_only=True, eq=False)
class SteadyMotion(JointHistory):
    """One period of the motion that an integration has reached, joints at the instants of the samples."""

    angular_frequency: float
    level: float
    """Omega [rad/s] and the scale of the harmonic force [-]."""
    steps_per_period: int
    """Of the finest integration [-]."""
    samples: Float[Real, "t r"]
    """All degrees of freedom at the start of each step of the last period, t_j = j T / t, shape (t, r) [m]."""
    start: TransientState
    """State at the start of that period, its phase 0: the sliders to compare with."""
    final: TransientState
    """State at its end."""
    n_period: int
    """Periods integrated in all [-]."""
    period_multiple: int
    """Number of periods after which the motion repeats; 0 if none was found."""
    period_change: float
    """Change of the state over the last period, relative to the amplitude [-]."""
    distance: float
    """Estimate of the remaining transient, relative to the amplitude [-]."""
    step_error: float
    """Estimate of the error of the samples by the time step, from half as many steps (a third of the largest
    difference, in the norm of mass, over the largest displacement from the mean) [-]; nan if not estimated."""

    @property
    def periodic(self) -> bool:
        """Whether the motion has the period of the excitation."""
        return self.period_multiple == 1

    @property
    def message(self) -> str:
        """Sentence on the steady state that was reached."""
        if self.period_multiple == 1:
            return f"the motion repeats every period of the excitation, detected after {self.n_period} periods"
        if self.period_multiple:
            return f"the motion repeats every {self.period_multiple} periods of the excitation"
        return (
            f"the motion does not repeat within {self.n_period} periods: it still changes by {self.period_change:.1e} "
            f"of its amplitude per period, {self.distance:.1e} from a steady state at the observed decay"
        )

    def coefficients(self, n_harmonic: int) -> Complex[Array, "harmonic r"]:
        """q_k of q(t) = Re sum q_k e^{i k Omega t} for k = 0 to n_harmonic - 1, shape (n_harmonic, r) [m].

        Raises
        ------
        TransientError
            A motion that has not the period of the excitation, or more harmonics than the samples hold.
        """
        if not self.periodic:
            raise TransientError(f"{self.message}: it has no Fourier series of one period")
        n_sample = len(self.samples)
        if not 1 <= check_whole_number(n_harmonic, "n_harmonic", TransientError) <= (n_sample + 1) // 2:
            raise TransientError(
                f"n_harmonic = {n_harmonic} must lie between 1 and {(n_sample + 1) // 2}: there are {n_sample} samples"
            )
        series = np.fft.rfft(self.samples, axis=0)[:n_harmonic] * (2 / n_sample)
        series[0] /= 2
        return np.asarray(series, dtype=np.complex128)


@on_one_blas_thread
def steady_motion(
    system: JointedSystem,
    angular_frequency: float,
    start: TransientState | None = None,
    level: float = 1.0,
    *,
    tolerance: float = 1e-5,
    max_period: int = 5000,
    steps_per_period: int = 256,
    step_tolerance: float = 1e-3,
    max_steps_per_period: int = 4096,
    acceleration: int = 0,
) -> SteadyMotion:
    """Integrate until the motion repeats, then with steps of half the length until their error is small.

    A motion that does not repeat is returned as such, see `SteadyMotion.period_multiple` and `.message`.

    Parameters
    ----------
    system
        Structure, joints and loads.
    angular_frequency
        Omega [rad/s].
    start
        Where to start, for instance `start_from` coefficients of a periodic motion; equilibrium by default.
    level
        Scale of the harmonic force [-].
    tolerance
        What may be left of the transient, relative to the amplitude [-].
    max_period
        Periods for each length of the step [-].
    steps_per_period
        At first; doubled until `step_error` is below `step_tolerance`, at most to `max_steps_per_period`, which it
        may equal: then no error is estimated [-].
    step_tolerance
        See `SteadyMotion.step_error` [-].
    max_steps_per_period
        See `steps_per_period` [-].
    acceleration
        Periods that are combined to jump towards the steady state (Anderson acceleration); 0 follows the motion as it
        is. A jump drags sliders as no motion would, and may end in another steady state where many exist, or in one
        that is unstable and that no motion would reach [-].

    Raises
    ------
    TransientError
        Numbers out of range, or what `transient.integrate.integrate` refuses.
    """
    _check_numbers(tolerance, step_tolerance, max_period, acceleration, steps_per_period, max_steps_per_period)
    structure = make_modal_structure(system)
    steps, n_period, step_error = steps_per_period, 0, np.nan
    coarse: Matrix | None = None
    while True:
        stepper = Stepper(structure, angular_frequency, steps, start, level)
        try:
            motion, record = _settle(stepper, tolerance, max_period, acceleration)
        except StepError:
            if 2 * steps > max_steps_per_period:
                raise
            coarse, steps = None, 2 * steps
            continue
        n_period += motion.n_period
        fine = record.modal_displacement
        if coarse is not None and motion.periodic:
            swing = np.linalg.norm(fine - fine.mean(axis=0), axis=1).max()
            difference = np.linalg.norm(fine[::2] - coarse, axis=1).max()
            step_error = float(difference / swing / 3) if swing > 0 else 0.0
        if not motion.periodic or step_error <= step_tolerance or 2 * steps > max_steps_per_period:
            break
        coarse, start, steps = fine, motion.start, 2 * steps
    return replace(motion, n_period=n_period, step_error=step_error)


def _check_numbers(
    tolerance: float, step_tolerance: float, max_period: int, acceleration: int, steps_per_period: int,
    max_steps_per_period: int,
) -> None:  # fmt: skip
    """Refuse numbers that are out of range."""
    for name, value in (("tolerance", tolerance), ("step_tolerance", step_tolerance)):
        if not 0 < check_real_number(value, name, TransientError) < 1:
            raise TransientError(f"{name} = {value} must lie between 0 and 1")
    for name, count in (
        ("max_period", max_period),
        ("steps_per_period", steps_per_period),
        ("max_steps_per_period", max_steps_per_period),
        ("acceleration", acceleration),
    ):
        check_whole_number(count, name, TransientError)
    if max_period < 1 or acceleration < 0 or max_steps_per_period < steps_per_period:
        raise TransientError(
            f"max_period = {max_period} must be at least 1, acceleration = {acceleration} at least 0 and "
            f"max_steps_per_period = {max_steps_per_period} at least steps_per_period = {steps_per_period}"
        )


def _settle(
    stepper: Stepper, tolerance: float, max_period: int, acceleration: int
) -> tuple[SteadyMotion, PeriodRecord]:
    """Steady state by steps of one length, without an estimate of their error, and its record."""
    structure = stepper.structure
    period = 2 * np.pi / stepper.angular_frequency
    slowest = min(float(np.exp(-0.5 * max(np.diag(structure.damping).min(), 0.0) * period)), SLOWEST)
    weight = _compute_weights(structure)
    marks = [stepper.vector * weight]
    changes: list[float] = []
    jump = AndersonAcceleration(acceleration)
    for _ in range(max_period):
        start = stepper.state
        record = stepper.record()
        amplitude = record.amplitude
        mark = stepper.vector * weight
        change = float(np.linalg.norm(mark - marks[-1])) / amplitude
        changes.append(change)
        rate = _estimate_decay(changes, slowest)
        multiple, distance = 1, change / (1 - rate)
        if distance <= tolerance:
            break
        multiple, left = _find_multiple(marks, mark, amplitude, tolerance, slowest)
        if multiple:
            distance = left
            break
        marks = [*marks[-N_MULTIPLE:], mark]
        if acceleration:
            jumped = jump.next(marks[-2], mark)
            if jumped is not mark:
                stepper.vector = jumped / weight
                marks = [stepper.vector * weight]
    return SteadyMotion(
        angular_frequency=stepper.angular_frequency,
        level=stepper.level,
        steps_per_period=stepper.steps_per_period,
        samples=record.modal_displacement @ structure.mode_shapes.T,
        **record.joints,
        start=start,
        final=stepper.state,
        n_period=len(changes),
        period_multiple=multiple,
        period_change=change,
        distance=distance,
        step_error=np.nan,
    ), record


def _find_multiple(
    marks: list[Vector], mark: Vector, amplitude: float, tolerance: float, slowest: float
) -> tuple[int, float]:
    """Number m > 1 of periods after which the motion repeats, 0 if it does not, and the remaining transient."""
    far = [float(np.linalg.norm(mark - marks[-m])) / amplitude for m in range(1, min(N_MULTIPLE, len(marks)) + 1)]
    distinct = [m for m in range(2, len(far) + 1) if far[m - 1] <= DISTINCT * far[0]]
    for m in distinct:
        left = far[m - 1] / (1 - slowest**m)
        if left <= tolerance:
            # A motion of 2 periods repeats after 4 as well, and may seem closer there while it settles.
            return next(shorter for shorter in distinct if m % shorter == 0), left
    return 0, float("nan")


def _compute_weights(structure: ModalStructure) -> Vector:
    """Square roots of the energy weights of modal displacements, modal velocities and sliders."""
    frequency = np.sqrt(np.abs(structure.eigenvalue))
    # A rigid-body mode has no energy of displacement: its displacement is weighted like that of the slowest other mode.
    floor = 1e-6 * frequency.max()
    others = frequency[frequency > floor]
    frequency = np.maximum(frequency, others.min() if others.size else 1.0)
    return np.concatenate([frequency, np.ones_like(frequency), np.sqrt(structure.table.slider_stiffness)])


def _estimate_decay(changes: list[float], slowest: float) -> float:
    window = min(WINDOW, len(changes) - 1)
    if window < 1 or changes[-1] == 0.0:
        return slowest
    seen = float((changes[-1] / changes[-1 - window]) ** (1 / window))
    return min(max(seen, slowest), SLOWEST)
