"""The linear structure of a configuration at its frequencies, shared by models, draws and levels.

Preloads, friction coefficients and sliders leave the receptances alone, so that models that differ in them share one
structure; only the motion under the static load is their own.
"""

import weakref
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance, choose_samples
from hbsolve.condensed import Condensed, Recovery
from reduction.array_input import is_symmetric
from reduction.jointed_system import JointedSystem

Array = NDArray[np.complex128]
#: Memory that responses to unit joint forces may take [byte]; beyond, they are made at one frequency at a time.
RECOVERY = 2**26
#: Memory of those that come with dense solves, in all structures together: those that made them last have them [byte].
DENSE_RECOVERY = 3 * 2**30
#: Asymmetry of a damping matrix that is round-off, relative to its largest entry [-].
ROUND_OFF = 1e-12


class Stack(NamedTuple):
    """The linear structure at F frequencies; d joint directions, harmonics 0 to H."""

    angular_frequency: Float[NDArray[np.float64], " F"]
    columns: Complex[Array, "F harmonic d d"]
    static: Complex[Array, "harmonic d"]
    dynamic: Complex[Array, "F harmonic d"]


class RecentStructures:
    """Structures in the order in which they last made recoveries: the older ones lose what takes too much memory.

    A campaign has a few hundred frequencies, and a diagnosis a dozen models at once.
    """

    def __init__(self) -> None:
        self._structures: OrderedDict[int, weakref.ref[LinearStructure]] = OrderedDict()

    def add(self, structure: "LinearStructure") -> None:
        """Note a structure that has made recoveries, and free those of others, the oldest first."""
        self._structures[id(structure)] = weakref.ref(structure)
        self._structures.move_to_end(id(structure))
        total = 0
        for key, reference in reversed([*self._structures.items()]):
            alive = reference()
            if alive is None:
                del self._structures[key]
                continue
            total += alive.recovery_size
            if total > DENSE_RECOVERY and alive is not structure:
                alive.forget_recoveries()
                del self._structures[key]


#: Of this process.
RECENT = RecentStructures()


class UnitReadings(NamedTuple):
    """Readings of sensors in n states: under the static load, under 1 N, and under unit joint forces."""

    static: Complex[Array, "harmonic s"]
    dynamic: Complex[Array, "n harmonic s"]
    contact: Complex[Array, "n harmonic s d"]
    angular_frequency: Float[NDArray[np.float64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearStructure:
    """Structure between its joints at the frequencies that have been condensed so far.

    Parameters
    ----------
    balance
        Harmonic balance of the configuration.
    frequency_shift
        Relative shift of true frequencies above their labels [-].
    base
        The same structure under another static load, which has the receptances.
    """

    balance: HarmonicBalance
    frequency_shift: float
    base: "LinearStructure | None" = None
    _condensed: dict[float, Condensed] = field(default_factory=dict)
    _recovery: dict[float, Recovery] = field(default_factory=dict)
    _stack: dict[tuple[float, ...], Stack] = field(default_factory=dict)
    _row_recovery: dict[bytes, dict[float, tuple[Array, Array]]] = field(default_factory=dict)
    _read: dict[tuple[bytes, tuple[float, ...]], UnitReadings] = field(default_factory=dict)

    @classmethod
    def from_balance(cls, balance: HarmonicBalance, shift: float, near: "LinearStructure | None") -> "LinearStructure":
        """Structure of a balance that `balance_of` gave, with the results of the structure that is near."""
        if near is not None and near.frequency_shift == shift:
            return (
                near if balance is near.balance else cls(balance=balance, frequency_shift=shift, base=near.base or near)
            )
        return cls(balance=balance, frequency_shift=shift)

    def balance_of(self, system: JointedSystem, n_harmonic: int, n_sample: int) -> HarmonicBalance | None:
        """Balance of another system on the same linear structure; none if its structure is another."""
        balance = self.balance
        if n_harmonic != balance.n_harmonic:
            return None
        same = balance if system is balance.system else balance.on_same_structure(system)
        instants = n_sample or choose_samples(n_harmonic)
        return same if same is None or instants == same.n_sample else same.with_samples(instants)

    def at(self, frequency: float) -> Condensed:
        """The structure at a labelled frequency [Hz]."""
        if self.base is not None:
            return self.base.at(frequency)._replace(static=self._static)
        if frequency not in self._condensed:
            self.condense([frequency])
        return self._condensed[frequency]

    def condense(self, frequencies: Sequence[float]) -> None:
        """Condense at the frequencies that are not condensed yet, many at once."""
        if self.base is not None:
            self.base.condense(frequencies)
            return
        new = [frequency for frequency in dict.fromkeys(frequencies) if frequency not in self._condensed]
        omega = [2 * np.pi * frequency * (1 + self.frequency_shift) for frequency in new]
        if not self.balance.is_dense:
            self._condensed.update(zip(new, self.balance.at_each(omega), strict=True))
            return
        for frequency, item in zip(new, omega, strict=True):
            self._condensed[frequency], self._recovery[frequency] = self.balance.at_with_recovery(item)
        RECENT.add(self)

    @property
    def recovery_size(self) -> int:
        """Memory of all recoveries [byte]."""
        return self._size_of_one * len(self._recovery)

    @property
    def _size_of_one(self) -> int:
        """Memory of the recovery at one frequency [byte]."""
        return 16 * self.balance.n_harmonic * self.balance.n_direction * self.balance.system.n_dof

    def forget_recoveries(self) -> None:
        """Free the recoveries: they are made again where they are needed."""
        self._recovery.clear()

    def stacked(self, frequencies: tuple[float, ...]) -> Stack:
        """The structure at several frequencies."""
        if self.base is not None:
            return self.base.stacked(frequencies)._replace(static=self._static)
        if frequencies not in self._stack:
            self.condense(frequencies)
            rows = [self._condensed[frequency] for frequency in frequencies]
            self._stack[frequencies] = Stack(
                np.array([row.angular_frequency for row in rows]),
                np.array([row.columns for row in rows]),
                rows[0].static,
                np.array([row.dynamic for row in rows]),
            )
            # One copy of the receptances is enough: they are the largest part.
            for frequency, row, stored in zip(frequencies, rows, self._stack[frequencies].columns, strict=True):
                self._condensed[frequency] = row._replace(columns=stored)
        return self._stack[frequencies]

    def recovery(self, frequency: float) -> Recovery | None:
        """Full responses to unit joint forces at a frequency; none where all frequencies would take too much memory."""
        source = self.base or self
        if frequency not in source._recovery:
            self.recover([frequency])
        own = source._recovery.get(frequency)
        if self.base is None or own is None:
            return own
        return own._replace(static=self._static_motion)

    def contact(self, frequency: float) -> Complex[Array, "harmonic r d"]:
        """Displacements at a frequency under a unit force along each joint direction [m/N]."""
        recovery = self.recovery(frequency) or self.balance.structure.recovery(self.at(frequency))
        return recovery.contact

    def recover(self, frequencies: Sequence[float]) -> None:
        """Make the recoveries at the frequencies that have none, many at once, as far as memory allows."""
        source = self.base or self
        source.condense(frequencies)
        new = [frequency for frequency in dict.fromkeys(frequencies) if frequency not in source._recovery]
        is_dense = source.balance.is_dense
        if not is_dense:
            new = new[: max(RECOVERY // max(source._size_of_one, 1) - len(source._recovery), 0)]
        if not new:
            return
        result = source.balance.structure.recoveries([source._condensed[frequency] for frequency in new])
        source._recovery.update(zip(new, result, strict=True))
        if is_dense:
            RECENT.add(source)

    def read(self, frequencies: tuple[float, ...], rows: Float[NDArray[np.float64], "s r"]) -> UnitReadings:
        """Readings of sensors with these rows over the displacement, shape (s, r)."""
        source, key = self.base or self, (rows.tobytes(), frequencies)
        static = self._static_motion @ rows.T
        if not frequencies:
            empty = np.zeros((0, *static.shape), dtype=np.complex128)
            return UnitReadings(static, empty, empty[..., None], np.zeros(0))
        if key not in source._read:
            omega = np.array([source.at(frequency).angular_frequency for frequency in frequencies])
            dynamic, contact = zip(*source.recover_rows(frequencies, rows), strict=True)
            source._read[key] = UnitReadings(static, np.array(dynamic), np.array(contact), omega)
        return source._read[key]._replace(static=static)

    def recover_rows(
        self, frequencies: Sequence[float], rows: Float[NDArray[np.float64], "s r"]
    ) -> list[tuple[Array, Array]]:
        """Readings at each frequency under 1 N, shape (H + 1, s), and unit joint forces, shape (H + 1, s, d)."""
        source = self.base or self
        known = source._row_recovery.setdefault(rows.tobytes(), {})
        new = [frequency for frequency in dict.fromkeys(frequencies) if frequency not in known]
        recovered = {
            frequency: own.at_rows(rows) for frequency in new if (own := source._recovery.get(frequency)) is not None
        }
        rest = [frequency for frequency in new if frequency not in recovered]
        condensed = [source.at(frequency) for frequency in rest]
        known |= recovered | dict(zip(rest, source.balance.structure.recover_rows(condensed, rows), strict=True))
        return [known[frequency] for frequency in frequencies]

    @property
    def reciprocal(self) -> "LinearStructure":
        """The reciprocal structure, with transposed damping: loads and responses change places.

        It is this one itself where the damping is symmetric, viscous and structural (Maxwell and Betti); gyroscopic
        and circulatory terms are not.
        """
        source = self.base or self
        # A structure that stores itself is freed by the garbage collector alone: a diagnosis of a rig took 17 GB.
        return source._transposed or source

    @cached_property
    def _transposed(self) -> "LinearStructure | None":
        """The structure with transposed damping; None where it is symmetric."""
        balance, system = self.balance, self.balance.system
        loss = system.structural_damping
        if all(item is None or is_symmetric(item, ROUND_OFF) for item in (system.damping, loss)):
            return None
        transposed = replace(system, damping=system.damping.T, structural_damping=None if loss is None else loss.T)
        turned = HarmonicBalance(system=transposed, n_harmonic=balance.n_harmonic, n_sample=balance.n_sample)
        return LinearStructure(balance=turned, frequency_shift=self.frequency_shift)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies that have been condensed so far [Hz]."""
        return tuple((self.base or self)._condensed)

    @cached_property
    def _static(self) -> Complex[Array, "harmonic d"]:
        """Motion of the joint directions under the static load, shape (H + 1, d) [m]."""
        return np.asarray(self._static_motion @ self.balance.structure.directions.T)

    @cached_property
    def _static_motion(self) -> Complex[Array, "harmonic r"]:
        """The same of all degrees of freedom, shape (H + 1, r) [m]."""
        return self.balance.structure.static_motion
