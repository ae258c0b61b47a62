"""The number over which a branch is continued: the frequency, the level of the force, or a parameter of a joint."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hbsolve.aft import InitialSliders, JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.linear_resonance import find_resonance_frequencies
from hbsolve.errors import BalanceError
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.newton import apply_receptance
from hbsolve.sampling import real_from_complex
from hbsolve.solution import forces_at, residual
from reduction.array_type import Real
from reduction.errors import JointError


@dataclass(frozen=True, kw_only=True, eq=False)
class Equation:
    """R and its derivatives at one point."""

    balance: HarmonicBalance
    condensed: Condensed
    forces: JointForces
    residual: Real
    by_value: Real
    """dR/dlambda at fixed motion, shape (d, nh)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Path(ABC):
    """A family of harmonic balances over one number lambda."""

    balance: HarmonicBalance

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of lambda in messages."""

    def displayed(self, value: float) -> float:
        """Lambda in that unit."""
        return value

    @abstractmethod
    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """The balance and its linear structure at lambda.

        Raises
        ------
        BalanceError
            A value that lambda cannot have.
        """

    @abstractmethod
    def by_value(self, balance: HarmonicBalance, condensed: Condensed, forces: JointForces) -> Real:
        """dR/dlambda at fixed motion."""

    def stops(self, first: float, last: float) -> tuple[Real, Real]:
        """Values between two others at which a step must stop, ascending, and their tolerances; none by default."""
        del first, last
        return np.zeros(0), np.zeros(0)


def equation(path: Path, value: float, x: Real, sliders: InitialSliders) -> Equation:
    """Residual and derivatives at a point of a path."""
    balance, condensed = path.at(value)
    forces = forces_at(balance, condensed.angular_frequency, x, sliders, want=PARAMETERS)
    return Equation(
        balance=balance,
        condensed=condensed,
        forces=forces,
        residual=residual(balance, condensed, x, forces),
        by_value=path.by_value(balance, condensed, forces),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyPath(Path):
    """Lambda is Omega [rad/s].

    Parameters
    ----------
    balance
        Balance with the level, which is that at 1 rad/s if the level varies with Omega.
    level_power
        Power p of Omega by which the level of the balance is multiplied: 0 for forces and accelerations of a base, 1
        for its velocity, 2 for its displacement and for an unbalance [-].
    """

    level_power: int = 0
    unit = "Hz"

    def displayed(self, value: float) -> float:
        """Omega in Hz."""
        return value / (2 * np.pi)

    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """See `Path`."""
        condensed = self.balance.at_with_slopes(value)
        return level_at(self.balance, value, self.level_power), condensed

    def by_value(self, balance: HarmonicBalance, condensed: Condensed, forces: JointForces) -> Real:
        """See `Path`."""
        slopes = condensed.slopes
        assert slopes is not None
        growth = self.level_power / condensed.angular_frequency
        moved = -real_from_complex(balance.level * (slopes.dynamic + growth * condensed.dynamic))
        moved += apply_receptance(slopes.columns, forces.coefficients)
        return np.asarray(moved + apply_receptance(condensed.columns, forces.by_frequency))

    def stops(self, first: float, last: float) -> tuple[Real, Real]:
        """Resonances of the structure with stuck joints."""
        return find_resonance_frequencies(self.balance, min(first, last), max(first, last))


def level_at(balance: HarmonicBalance, angular_frequency: float, level_power: int) -> HarmonicBalance:
    """The balance with its level times Omega^p."""
    return balance.at_level(balance.level * angular_frequency**level_power) if level_power else balance


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelPath(Path):
    """Lambda is the level of the harmonic force."""

    angular_frequency: float
    unit = "(level)"

    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """See `Path`."""
        return self.balance.at_level(value), _stored(self.balance, self.angular_frequency)

    def by_value(self, balance: HarmonicBalance, condensed: Condensed, forces: JointForces) -> Real:
        """See `Path`."""
        del balance, forces
        return -real_from_complex(condensed.dynamic)


@dataclass(frozen=True, kw_only=True, eq=False)
class JointPath(Path):
    """Lambda is a parameter of a joint.

    Parameters
    ----------
    balance
        Balance of a system with the joint.
    angular_frequency
        Omega [rad/s].
    joint, parameter
        Name of the joint, and of the field of its class, such as "friction_coefficient".

    Raises
    ------
    BalanceError
        No such joint or parameter.
    """

    angular_frequency: float
    joint: str
    parameter: str

    def __post_init__(self) -> None:
        find_joint_index(self.balance, self.joint, self.parameter)

    @property
    def unit(self) -> str:
        """See `Path`."""
        return f"({self.parameter} of {self.joint})"

    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """See `Path`.

        Raises
        ------
        BalanceError
            A value that the joint cannot have.
        """
        number, index = find_joint_index(self.balance, self.joint, self.parameter)
        try:
            self.balance.system.joints[number].with_values({self.parameter: value})
        except JointError as error:
            raise BalanceError(f"{error} all along its branch") from error
        table = self.balance.table
        values = table.value.copy()
        values[index] = value
        # The reference stiffness is kept: solutions do not depend on it, and the structure is not computed again.
        return self.balance.with_table(table._replace(value=values)), _stored(self.balance, self.angular_frequency)

    def by_value(self, balance: HarmonicBalance, condensed: Condensed, forces: JointForces) -> Real:
        """See `Path`."""
        number, index = find_joint_index(self.balance, self.joint, self.parameter)
        return np.asarray(apply_receptance(condensed.columns, spread(balance, number, forces.by_parameter[index])))


def find_joint_index(balance: HarmonicBalance, joint: str, parameter: str) -> tuple[int, int]:
    """Number of a joint, and of its parameter in the table.

    The message for a joint or parameter that does not exist lists those that exist (`BalanceError`).
    """
    names = [item.name for item in balance.system.joints]
    if joint not in names:
        raise BalanceError(f'there is no joint "{joint}": the system has {", ".join(names) or "none"}')
    number = names.index(joint)
    known = balance.system.joints[number].parameter_names
    if parameter not in known:
        raise BalanceError(f'joint "{joint}" has no parameter "{parameter}": it has {", ".join(known)}')
    return number, int(balance.table.parameter[number]) + known.index(parameter)


def spread(balance: HarmonicBalance, joint: int, values: Real) -> Real:
    """Coefficients of one joint's directions, shape (3, nh), among those of all, shape (d, nh)."""
    first, last = balance.table.direction[joint], balance.table.direction[joint + 1]
    g = np.zeros((balance.n_direction, values.shape[1]))
    g[first:last] = values[: last - first]
    return g


@lru_cache(maxsize=4)
def _stored(balance: HarmonicBalance, angular_frequency: float) -> Condensed:
    return balance.at(angular_frequency)
