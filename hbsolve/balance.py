"""The harmonic balance of a jointed system: its joints and its linear structure, computed once, and full responses."""

import warnings
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, log2
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from hbsolve.aft import BalanceArrays
from hbsolve.condensed import Condensed, CondensedStructure, Recovery
from hbsolve.errors import BalanceError, DampingWarning
from hbsolve.fourier import Coefficients
from hbsolve.joint_arrays import JointTable, list_force_addresses, make_joint_table
from hbsolve.sampling import Sampling, complex_from_real, real_from_complex, sampling
from reduction.array_input import check_real_number, check_whole_number
from reduction.array_type import Real, Whole
from reduction.available_memory import describe_lacking_memory
from reduction.joint_law.joint_arrays import addresses
from reduction.jointed_system import JointedSystem

#: Default samples per period: this many per harmonic, rounded up to a power of two, and at least LEAST_SAMPLE.
SAMPLE_PER_HARMONIC, LEAST_SAMPLE = 32, 128
#: Negative eigenvalue of the damping, relative to its largest entry or eigenvalue, that still counts as round-off.
NEGATIVE = 1e-9
#: Largest stiffness of the linear reference, and of a joint, over that of the structure along a direction [-]. With the
#: first a joint is practically rigid; with the second, round-off of its displacement makes an error of 1e-6 of its
#: force.
MAX_REFERENCE_RATIO, MAX_JOINT_RATIO = 1e6, 1e10
#: Stiffness along a direction, over the largest of all, that counts as zero [-].
ROUND_OFF = 1e-9
#: Number of arrays of instants and coefficients held while a basis is made, and of Jacobians of all joints in use [-].
BASES, JACOBIANS = 11, 2
#: Largest load [N]: norms of its response must not overflow.
MOST_FORCE = 1e100
#: Largest Omega [rad/s]: (H Omega)^4 must not overflow.
HIGHEST = 1e50


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicBalance:
    """A jointed system in harmonics 0 to H.

    Parameters
    ----------
    system
        Structure, its joints and its loads.
    n_harmonic
        Number of harmonics with the mean, H + 1 [-].
    n_sample
        Number of instants per period at which the joints are evaluated; by default 32 per harmonic, rounded up to a
        power of two, and at least 128. `hbsolve.truncation` estimates the error due to samples and harmonics [-].
    level
        Scale of the harmonic force; the static load does not scale [-].

    Raises
    ------
    BalanceError
        Too few harmonics for the force, too few samples for the harmonics, numbers of harmonics or samples that are not
        whole or whose arrays exceed the free memory, loads or joint stiffnesses too large to compute with, or a system
        of another type.
    ModelError
        Matrices that describe no vibrating structure, or a structure without support even with all contacts stuck.

    Warns
    -----
    DampingWarning
        Damping that adds energy to some motion.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 3-8 and 12.
    """

    system: JointedSystem
    n_harmonic: int
    n_sample: int = 0
    level: float = 1.0
    structure: CondensedStructure = field(init=False, repr=False)
    table: JointTable = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.system, JointedSystem):
            raise BalanceError(f"the system is a {type(self.system).__name__}: give a JointedSystem")
        for name in ("n_harmonic", "n_sample"):
            object.__setattr__(self, name, check_whole_number(getattr(self, name), name, BalanceError))
        object.__setattr__(self, "level", check_real_number(self.level, "level", BalanceError))
        object.__setattr__(self, "n_sample", self.n_sample or choose_samples(self.n_harmonic))
        self._check()
        table = _make_limited_table(self.system)
        object.__setattr__(self, "table", table)
        object.__setattr__(self, "structure", self._structure(table))
        _warn_of_negative_damping(self.system.damping, "damping", "N s/m")
        if self.system.structural_damping is not None:
            _warn_of_negative_damping(self.system.structural_damping, "structural damping", "N/m")

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a balance with the addresses that compiled functions have in this process."""
        joints = state["system"].joints
        table = state["table"]._replace(force=list_force_addresses(joints), address=addresses(joints))
        self.__dict__.update({**state, "table": table})

    def _check(self) -> None:
        highest, largest = self._loads
        if self.n_harmonic < 1 or self.n_harmonic <= highest:
            raise BalanceError(
                f"n_harmonic = {self.n_harmonic} (H = {self.n_harmonic - 1}) cannot hold a force in harmonic "
                f"{highest}: take at least n_harmonic = {highest + 1}"
            )
        if self.n_sample < 4 * self.n_harmonic - 3:
            raise BalanceError(
                f"n_sample = {self.n_sample} is too few for H = {self.n_harmonic - 1}: joints need 4 H + 1 samples at "
                f"least, {4 * self.n_harmonic - 3}, and friction many more"
            )
        _refuse_beyond_memory(
            sum(len(joint.directions) for joint in self.system.joints), self.n_harmonic, self.n_sample
        )
        if not np.isfinite(self.level):
            raise BalanceError(f"level = {self.level} must be a finite number")
        if largest[0] > MOST_FORCE or abs(self.level) > MOST_FORCE / max(largest[1], 1.0):
            raise BalanceError(
                f"level = {self.level:g} of a harmonic force of {largest[1]:g} N, and a static load of {largest[0]:g} "
                f"N: no load may exceed {MOST_FORCE:g} N, because squares of motions would overflow: give smaller "
                "loads"
            )

    @cached_property
    def _loads(self) -> tuple[int, tuple[float, float]]:
        """Highest harmonic of the force, and the largest static and harmonic loads [N]."""
        highest = max((int(k) for k in np.flatnonzero(self.system.dynamic.any(axis=1))), default=0)
        return highest, (float(np.abs(self.system.static).max()), float(np.abs(self.system.dynamic).max()))

    def _structure(self, table: JointTable) -> CondensedStructure:
        system = self.system
        static = np.zeros((self.n_harmonic, system.n_dof), dtype=np.complex128)
        dynamic = np.zeros_like(static)
        static[0] = system.static
        dynamic[: min(len(system.dynamic), self.n_harmonic)] = system.dynamic[: self.n_harmonic]
        rows = np.vstack([np.zeros((0, system.n_dof)), *(joint.directions for joint in system.joints)])
        return CondensedStructure(
            mass=system.mass,
            damping=system.damping,
            stiffness=system.stiffness,
            # The basis is not that of a structure to which a body was added.
            basis=system.basis if system.basis is not None and system.basis.shape == system.mass.shape else None,
            structural=system.structural_damping,
            directions=rows,
            reference=table.reference,
            static=static,
            dynamic=dynamic,
        )

    def at_level(self, level: float) -> "HarmonicBalance":
        """The same system with its harmonic force scaled; shares the modal decomposition."""
        return self._shared(level=check_real_number(level, "level", BalanceError))

    def with_samples(self, n_sample: int) -> "HarmonicBalance":
        """The same balance with another number of samples."""
        return self._shared(n_sample=check_whole_number(n_sample, "n_sample", BalanceError))

    def with_harmonics(self, n_harmonic: int, n_sample: int) -> "HarmonicBalance":
        """The same system in more harmonics; shares the modal decomposition."""
        structure = copy(self.structure)
        for name in ("static", "dynamic"):
            padded = np.zeros((n_harmonic, self.system.n_dof), dtype=np.complex128)
            retained = min(n_harmonic, self.n_harmonic)
            padded[:retained] = getattr(self.structure, name)[:retained]
            object.__setattr__(structure, name, padded)
        return self._shared(n_harmonic=n_harmonic, n_sample=n_sample, structure=structure)

    def with_table(self, table: JointTable) -> "HarmonicBalance":
        """The same balance with other values of the joints' parameters, on the same linear reference."""
        other = self._shared()
        object.__setattr__(other, "table", table)
        return other

    def on_same_structure(self, system: JointedSystem) -> "HarmonicBalance | None":
        """The balance of a system that differs only in its static load and in the parameters of its joints.

        None if the linear structure with all contacts stuck, the directions or the harmonic force differ.
        """
        own, table = self.system, _make_limited_table(system)
        matrices = ("mass", "damping", "stiffness", "structural_damping", "dynamic")
        pairs = [(getattr(own, name), getattr(system, name)) for name in matrices]
        pairs += [(self.table.reference, table.reference), (self.table.kind, table.kind)]
        directions = [joint.directions for joint in system.joints]
        pairs.append(
            (self.structure.directions, np.vstack(directions) if directions else self.structure.directions[:0])
        )
        if not all(one is other or np.array_equal(one, other) for one, other in pairs):
            return None
        static = np.zeros_like(self.structure.static)
        static[0] = system.static
        return self._shared(system=system, table=table, structure=self.structure.with_static(static))

    def _shared(self, **changes: Any) -> "HarmonicBalance":
        # Copied, since the modal decomposition is expensive. `copy` would look up all compiled laws again.
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        for cached in ("sampling", "joint_of_direction", "arrays", "_loads"):
            other.__dict__.pop(cached, None)
        for name, value in changes.items():
            object.__setattr__(other, name, value)
        other._check()
        return other

    @property
    def is_dense(self) -> bool:
        """Whether each frequency takes dense solves: a `Recovery` then pays off from the second state on."""
        return self.structure.is_dense

    @property
    def main_harmonic(self) -> int:
        """The lowest harmonic of the load above the mean; without a harmonic load 1, or 0 if H = 0 [-]."""
        acted = np.flatnonzero(self.system.dynamic.any(axis=1))
        return next((int(k) for k in acted if k), min(1, self.n_harmonic - 1))

    @property
    def n_direction(self) -> int:
        """Number of joint directions d [-]."""
        return len(self.table.reference)

    @property
    def n_slider(self) -> int:
        """Number of sliders s [-]."""
        return int(self.table.slider[-1])

    @cached_property
    def sampling(self) -> Sampling:
        """Fourier basis on the instants of a period."""
        return sampling(self.n_harmonic, self.n_sample)

    @cached_property
    def joint_of_direction(self) -> tuple[Int[Whole, " d"], Int[Whole, " d"]]:
        """First direction, and number of directions, of the joint of each direction."""
        count = np.diff(self.table.direction)
        return np.repeat(self.table.direction[:-1], count), np.repeat(count, count)

    @cached_property
    def arrays(self) -> BalanceArrays:
        """Joints and instants as arguments of compiled code."""
        return BalanceArrays(self.table, *self.joint_of_direction, self.sampling)

    def find_stiffer_joint(self) -> tuple[str, float, float] | None:
        """Name and stiffness of a joint stiffer than its linear reference, and that of the reference [N/m]; or None."""
        for joint, first in zip(self.system.joints, self.table.direction, strict=False):
            for stiffness, most in zip(joint.reference_stiffness, self.table.reference[first:], strict=False):
                if stiffness > most:
                    return joint.name, stiffness, float(most)
        return None

    def at(self, angular_frequency: float) -> Condensed:
        """The linear structure at one frequency.

        Parameters
        ----------
        angular_frequency
            Omega [rad/s].

        Raises
        ------
        BalanceError
            A frequency that is not positive, or too high to compute with.
        """
        return self.structure.at(check_frequency(angular_frequency))

    def at_each(self, angular_frequencies: Sequence[float]) -> list[Condensed]:
        """The linear structure at several frequencies, in less time than by `at`."""
        return self.structure.at_each([check_frequency(item) for item in angular_frequencies])

    def at_with_recovery(self, angular_frequency: float) -> tuple[Condensed, Recovery]:
        """As `at`, with the recovery of full responses, for a structure that takes dense solves."""
        return self.structure.at_with_recovery(check_frequency(angular_frequency))

    def at_with_slopes(self, angular_frequency: float) -> Condensed:
        """As `at`, with derivatives in Omega."""
        return self.structure.at_with_slopes(check_frequency(angular_frequency))

    def linear(self, condensed: Condensed, level: float | None = None) -> Real:
        """Motion of the directions with all contacts stuck, x_lin, shape (d, nh) [m]."""
        scale = self.level if level is None else level
        return real_from_complex(condensed.static + scale * condensed.dynamic)

    def response(self, condensed: Condensed, g: Real, recovery: Recovery | None = None) -> Coefficients:
        """Full response to the loads and the joint forces, shape (H + 1, r) [m].

        Parameters
        ----------
        condensed
            The linear structure at Omega.
        g
            Joint force beyond D x, shape (d, nh) [N].
        recovery
            Recovery of the structure at this Omega, if several states use it; a direct solve by default.
        """
        return self.respond(condensed, complex_from_real(g), recovery)

    def respond(self, condensed: Condensed, g: Coefficients, recovery: Recovery | None = None) -> Coefficients:
        """As `response`, to complex coefficients of the joint forces, shape (H + 1, d) [N]."""
        structure = self.structure
        if recovery is None:
            force = structure.static + self.level * structure.dynamic - g @ structure.directions
            q = structure.displacement(condensed, force)
        else:
            joint_response = (recovery.contact @ g[..., None])[..., 0]
            q = recovery.static + self.level * recovery.dynamic - joint_response
        q[0] = q[0].real
        return q


def choose_samples(n_harmonic: int) -> int:
    """Default number of instants per period for H + 1 = n_harmonic [-]."""
    return int(2 ** ceil(log2(max(SAMPLE_PER_HARMONIC * (n_harmonic - 1), LEAST_SAMPLE))))


def _make_limited_table(system: JointedSystem) -> JointTable:
    """Joints as arrays, with a linear reference that is not much stiffer than the structure where they act.

    A slip moves a contact by its force over the stiffness of the structure, and the linear reference by its force over
    the stiffness of the reference: if the second is lost in the round-off of the first, so is the response.
    """
    table = make_joint_table(system.joints)
    if not len(table.reference):
        return table
    rows = np.vstack([joint.directions for joint in system.joints])
    beside = np.einsum("ij,ij->i", rows @ system.stiffness, rows) / np.einsum("ij,ij->i", rows, rows) ** 2
    # The stiffness of a body that is held by joints alone is round-off of its elements.
    round_off = ROUND_OFF * np.abs(system.stiffness).max()
    most = np.where(beside > round_off, MAX_REFERENCE_RATIO * beside, np.inf)
    excess = table.reference / most
    if excess.max() * MAX_REFERENCE_RATIO > MAX_JOINT_RATIO:
        worst = int(excess.argmax())
        name = system.joints[int(np.searchsorted(table.direction, worst, side="right")) - 1].name
        raise BalanceError(
            f'joint "{name}" has a stiffness of {table.reference[worst]:.3g} N/m, where the structure has '
            f"{beside[worst]:.3g} N/m: 16 digits do not resolve this ratio; {most[worst]:.3g} N/m are practically "
            "rigid there"
        )
    return table._replace(reference=np.minimum(table.reference, most))


def _refuse_beyond_memory(n_direction: int, n_harmonic: int, n_sample: int) -> None:
    """Refuse harmonics and samples whose arrays exceed the free memory."""
    nh = 2 * n_harmonic - 1
    needed = 8.0 * (BASES * nh * n_sample + JACOBIANS * n_direction * 3 * nh**2 + 4 * n_direction * n_sample)
    if lacking := describe_lacking_memory(needed):
        raise BalanceError(
            f"H = {n_harmonic - 1} with {n_sample} samples and {n_direction} joint directions takes {lacking}: take "
            "fewer harmonics or samples"
        )


def check_frequency(angular_frequency: float) -> float:
    """Return Omega [rad/s]; refuse (`BalanceError`) a value that is not positive or too high to compute with."""
    omega = check_real_number(angular_frequency, "angular_frequency", BalanceError)
    if not (np.isfinite(omega) and omega > 0):
        raise BalanceError(f"angular_frequency = {omega:g} rad/s must be positive: give a static load as static_load")
    if omega > HIGHEST:
        raise BalanceError(f"angular_frequency = {omega:g} rad/s must be below {HIGHEST:g} rad/s: squares overflow")
    return omega


def _warn_of_negative_damping(damping: Float[Real, "r r"], name: str, unit: str) -> None:
    """Warn of a negative eigenvalue of the symmetric part of the damping, the only part that does work in a motion.

    It is no error, because follower forces, such as those in the bearings of rotors, may have one.
    """
    values = np.linalg.eigvalsh((damping + damping.T) / 2)
    largest = max(float(np.abs(values).max()), float(np.abs(damping).max()))
    if values[0] < -NEGATIVE * largest:
        warnings.warn(
            f"the {name} has the eigenvalue {values[0]:.3g} {unit} in its symmetric part, whose largest is "
            f"{values[-1]:.3g} {unit}: it adds energy to a motion, like follower forces, so check its sign if the "
            "structure is passive",
            DampingWarning,
            stacklevel=4,  # the line that makes the balance
        )
