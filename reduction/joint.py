"""What a joint is, as data alone: its rows and its parameters.

`reduction.jointed_system` says how a joint acts on a structure, makes the rows, and has all these names as well.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.errors import JointError
from reduction.joint_check import check_not_negative, check_positive, label, lock_numbers

Row = Float[NDArray[np.float64], " r"]


class Friction(Enum):
    """How the two tangents of a contact share Coulomb's limit."""

    UNCOUPLED = "uncoupled"
    """Each tangent has a limit mu N of its own."""
    COULOMB = "coulomb"
    """The resultant has the limit mu N and opposes the sliding (isotropic)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionContact:
    r"""The paper's contact element: a unilateral normal spring beside elastic Coulomb friction in one or two tangents.

    .. math:: N = \max(N_0 + k_n (v - g),\ 0), \qquad T = k_t (u - w), \qquad |T| \le \mu N

    with v > 0 closing; w is the position of the slider, and T = 0 in lift-off.

    Parameters
    ----------
    name
        What messages and results call it.
    normal
        Row of v, shape (r,) [-].
    tangents
        Rows of u, shape (1, r) or (2, r); one row of shape (r,) is taken as (1, r) [-].
    normal_stiffness, tangential_stiffness
        k_n and k_t [N/m].
    friction_coefficient
        mu [-].
    preload
        N_0 [N], the normal force at v = g; negative holds the contact open by that force.
    gap
        g [m]; negative is an interference.
    friction
        How two tangents share the limit.

    Raises
    ------
    JointError
        A stiffness that is not positive, a negative friction coefficient, a number that is not finite, or another
        friction.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 6-8.
    """

    name: str
    normal: Row
    tangents: Float[NDArray[np.float64], "tangent r"]
    normal_stiffness: float
    tangential_stiffness: float
    friction_coefficient: float
    preload: float = 0.0
    gap: float = 0.0
    friction: Friction = Friction.UNCOUPLED

    def __post_init__(self) -> None:
        lock_numbers(self, "normal", "tangents")
        if self.tangents.ndim == 1:
            object.__setattr__(self, "tangents", self.tangents[None, :])
        if self.tangents.ndim != 2 or len(self.tangents) not in {1, 2}:
            raise JointError(f'contact "{self.name}" has tangents of shape {self.tangents.shape}: give one or two rows')
        if self.tangents.shape[1:] != self.normal.shape:
            raise JointError(
                f'contact "{self.name}" has a normal over {self.normal.size} degrees of freedom but tangents over '
                f"{self.tangents.shape[1]}: both are rows over the whole structure"
            )
        check_positive(self, "normal_stiffness", "tangential_stiffness")
        check_not_negative(self, "friction_coefficient")
        friction: object = self.friction
        if not isinstance(friction, Friction):
            known = " or ".join(str(each) for each in Friction)
            raise JointError(f"{label(self)}: friction = {friction!r} must be {known}")

    @property
    def directions(self) -> Float[NDArray[np.float64], "d r"]:
        """Tangents, then the normal, shape (n_tangent + 1, r) [-]."""
        return np.vstack([self.tangents, self.normal])

    @property
    def force_at_rest(self) -> float:
        """N at v = 0 [N]; zero where the contact is open."""
        return max(self.preload - self.normal_stiffness * self.gap, 0.0)

    @property
    def limit_at_rest(self) -> float:
        """Coulomb's limit mu N at v = 0 [N]."""
        return self.friction_coefficient * self.force_at_rest


@dataclass(frozen=True, kw_only=True, eq=False)
class JenkinsElement:
    r"""A spring and a slider in series with a constant limit: T = k_t (u - w), abs(T) <= limit_force.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        k_t [N/m].
    limit_force
        mu N [N].

    Raises
    ------
    JointError
        A stiffness that is not positive, a negative limit, or a number that is not finite.
    """

    name: str
    direction: Row
    tangential_stiffness: float
    limit_force: float

    def __post_init__(self) -> None:
        lock_numbers(self, "direction")
        check_positive(self, "tangential_stiffness")
        check_not_negative(self, "limit_force")

    @property
    def directions(self) -> Float[NDArray[np.float64], "1 r"]:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]


@dataclass(frozen=True, kw_only=True, eq=False)
class CubicSpring:
    """f = stiffness u^3.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, shape (r,) [-].
    stiffness
        [N/m^3], of either sign.

    Raises
    ------
    JointError
        A number that is not finite.
    """

    name: str
    direction: Row
    stiffness: float

    def __post_init__(self) -> None:
        lock_numbers(self, "direction")

    @property
    def directions(self) -> Float[NDArray[np.float64], "1 r"]:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticStop:
    """f = stiffness max(u - gap, 0): a one-sided stop without friction.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, positive towards the stop, shape (r,) [-].
    stiffness
        [N/m].
    gap
        [m]; negative is a pre-compressed stop.

    Raises
    ------
    JointError
        A stiffness that is not positive, or a number that is not finite.
    """

    name: str
    direction: Row
    stiffness: float
    gap: float = 0.0

    def __post_init__(self) -> None:
        lock_numbers(self, "direction")
        check_positive(self, "stiffness")

    @property
    def directions(self) -> Float[NDArray[np.float64], "1 r"]:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]


@dataclass(frozen=True, kw_only=True, eq=False)
class QuadraticDamper:
    """f = damping |du/dt| du/dt: drag of the surrounding air.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, shape (r,) [-].
    damping
        [N s^2/m^2], not negative.

    Raises
    ------
    JointError
        A negative damping, or a number that is not finite.
    """

    name: str
    direction: Row
    damping: float

    def __post_init__(self) -> None:
        lock_numbers(self, "direction")
        check_not_negative(self, "damping")

    @property
    def directions(self) -> Float[NDArray[np.float64], "1 r"]:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]


Joint = FrictionContact | JenkinsElement | CubicSpring | ElasticStop | QuadraticDamper
