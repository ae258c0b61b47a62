"""Data of every joint law, and the registry of all laws.

A law is a frozen dataclass derived from `Joint`: rows, numbers, and the facts that the rest of the program asks for
instead of its type. `docs/extending.md` shows how to add one.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from jaxtyping import Float

from geometry.registry import Registry
from reduction.array_input import check_array, check_finite_number
from reduction.array_type import Real, Row, Rows
from reduction.errors import ExchangeError, JointError

Samples = Float[Real, "d n"]


class Plausible(NamedTuple):
    """Largest plausible value of a parameter: a larger number is a mistake, or meant for something else."""

    largest: float
    remedy: str
    """What a larger number is, and what to give in its place: the end of a sentence that begins with the number."""

    def doubt(self, value: float) -> str:
        """Warning about a number that is too large; empty otherwise."""
        return f"{value:g} {self.remedy}" if value > self.largest else ""


@dataclass(frozen=True, kw_only=True)
class LawParameter:
    """A number of a law, as a case file gives it.

    Parameters
    ----------
    name
        Of the field.
    unit
        As text that `study.quantity` understands, such as "N/m"; "-" for none.
    meaning
        One line for tables and documents.
    typical
        A value of a usual size: examples and sweeps over all laws take it.
    lower
        Least value; none by default.
    positive
        It must be larger than 0.
    plausible
        What real joints have; anything within the bounds by default.
    default
        None where it must be given.
    is_list
        It is a list of such numbers, at least one; its field is a tuple.
    is_form
        It gives the law its form, as an exponent does, and not its size.
    """

    name: str
    unit: str
    meaning: str
    typical: float
    lower: float = -np.inf
    positive: bool = False
    plausible: Plausible | None = None
    default: float | None = None
    is_list: bool = False
    is_form: bool = False

    def names(self, joint: "Joint") -> tuple[str, ...]:
        """Its name, or that of each number of a list, such as "limit_force[0]"."""
        if not self.is_list:
            return (self.name,)
        return tuple(f"{self.name}[{number}]" for number in range(len(getattr(joint, self.name))))

    def values(self, joint: "Joint") -> tuple[float, ...]:
        """Its value, or those of a list."""
        value = getattr(joint, self.name)
        return value if self.is_list else (value,)

    def check(self, joint: "Joint") -> None:
        """Refuse a value outside the bounds (`JointError`)."""
        for name, value in zip(self.names(joint), self.values(joint), strict=True):
            if self.positive and not value > 0:
                raise JointError(f'joint "{joint.name}": {name} = {value:g} must be positive')
            if value < self.lower:
                least = "must not be negative" if self.lower == 0 else f"must be at least {self.lower:g}"
                raise JointError(f'joint "{joint.name}": {name} = {value:g} {least}')
            if self.plausible is not None and (doubt := self.plausible.doubt(value)):
                raise JointError(f'joint "{joint.name}": {name} = {doubt}')


@dataclass(frozen=True, kw_only=True)
class LawOption:
    """A choice of a law, as a case file gives it: one of several words.

    Parameters
    ----------
    name
        Of the field.
    choices
        Words; the first is the default.
    meaning
        One line for tables and documents.
    """

    name: str
    choices: tuple[str, ...]
    meaning: str


class MachineCode(Protocol):
    """A compiled function of a user's: `reduction.joint_law.function_law.CompiledFunction`."""

    @property
    def address(self) -> int:
        """Where it is in this process."""


class SliderInterval(NamedTuple):
    """A slider that sticks while abs(k_t (u - w)) <= constant + by_normal v."""

    tangent: int
    """Direction of u."""
    normal: int
    """Direction of v, -1 for none."""
    stiffness: float
    """k_t [N/m]."""
    constant: float
    """mu (N_0 - k_n g), or the constant limit [N]."""
    by_normal: float
    """mu k_n, 0 for a constant limit [N/m]."""


class Joint(ABC):
    """A joint: what acts between rows over the degrees of freedom of a structure.

    A law states all that has no default here; it is refused by the registry otherwise. A default is what is true of a
    law that does not say more, or a refusal.
    """

    kind: ClassVar[str]
    """Name of the law in registries and case files."""
    parameters: ClassVar[tuple[LawParameter, ...]]
    """In the order in which its force reads them; each is a field."""
    typical_displacement: ClassVar[float]
    """Displacement at which it shows what it is, with the typical parameters [m]."""
    options: ClassVar[tuple[LawOption, ...]] = ()
    """Choices; each is a field."""
    places: ClassVar[Mapping[str, bool]] = {"direction": True}
    """Rows that a case file gives by name, and whether each must be given."""
    series_springs: ClassVar[bool] = False
    """The elastic energy of each direction is force^2 / (2 stuck stiffness), whatever the motion; of the normal
    direction it is taken about the mean displacement, as of every spring that may open."""
    can_slip: ClassVar[bool] = True
    """It sticks and slips, or opens; a stop is closed or open alone."""
    one_sided: ClassVar[bool] = False
    """Its force differs in kind for u and -u, so that the sign of its row matters."""
    nlvib: ClassVar[tuple[str, Mapping[str, str]] | None] = None
    """Type of its element in NLvib, and names of NLvib's numbers with the fields that they are; none for a law that
    other programs do not have."""

    function: ClassVar[MachineCode | None] = None
    """Force as a user's function, which is called by its address; none for a law whose force is part of `hbsolve`."""

    name: str

    def check_fields(self, *rows: str) -> None:
        """Replace the rows of these names by read-only copies and all scalars by floats, and check the parameters.

        Entries that are no finite real numbers, a row of zeros or of another shape, and a parameter outside its bounds
        are refused (`JointError`).
        """
        for name in rows:
            what = f'joint "{self.name}": its {name}'
            row = check_array(getattr(self, name), what, JointError)
            object.__setattr__(self, name, row)
            if name != "tangents" and row.ndim != 1:
                raise JointError(f"{what} has shape {row.shape}, give one row of shape (r,)")
            if not np.isfinite(row).all() or not row.any():
                raise JointError(f"{what} must hold finite numbers, not all of them zero")
        for field in fields(self):  # type: ignore[arg-type]
            if field.type is float:
                value = check_finite_number(getattr(self, field.name), f'joint "{self.name}": {field.name}', JointError)
                object.__setattr__(self, field.name, value)
        for parameter in self.parameters:
            if parameter.is_list:
                object.__setattr__(self, parameter.name, self._listed(parameter.name))
            parameter.check(self)

    def _listed(self, name: str) -> tuple[float, ...]:
        """The list of a field, for which one number is a list of one."""
        what = f'joint "{self.name}": {name}'
        values = np.atleast_1d(check_array(getattr(self, name), what, JointError))
        if values.ndim != 1 or not values.size:
            raise JointError(f"{what} has shape {values.shape}: give a list of at least one number")
        return tuple(check_finite_number(value, f"{what}[{number}]", JointError) for number, value in enumerate(values))

    @property
    @abstractmethod
    def directions(self) -> Rows:
        """Rows along which it acts, shape (d, r) [-]."""

    @property
    @abstractmethod
    def n_slider(self) -> int:
        """Numbers that it remembers from one instant to the next: sliders, or other variables of state [-]."""

    @property
    @abstractmethod
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness of each direction while it sticks and is closed; 0 for what is weak at rest, shape (d,) [N/m]."""

    @abstractmethod
    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row | None:
        """Elastic energy of the vibration at each instant, shape (n,) [J]; None for a law that stores none.

        Parameters
        ----------
        parameters
            Values by name; along a branch over a parameter they are not the joint's own.
        displacement
            Of each direction, shape (d, n) [m].
        force
            Of each direction without its mean, shape (d, n) [N].
        slider
            What it remembers, shape (s, n).
        """

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """In the order in which its force reads them; each number of a list has a name of its own."""
        return tuple(name for parameter in self.parameters for name in parameter.names(self))

    @property
    def parameter_values(self) -> tuple[float, ...]:
        """The same."""
        return tuple(value for parameter in self.parameters for value in parameter.values(self))

    @property
    def force_law(self) -> str:
        """Name of the compiled force: one data class may have several."""
        return self.kind

    @property
    def reference_stiffness(self) -> tuple[float, ...]:
        """Stiffness of each direction in the linear structure of the balance, D of eq. 12, shape (d,) [N/m]."""
        return self.stuck_stiffness

    @property
    def stuck_force(self) -> tuple[float, ...]:
        """Force of each direction at u = 0 while it sticks and is closed, shape (d,) [N]."""
        return (0.0,) * len(self.stuck_stiffness)

    @property
    def normal_direction(self) -> int | None:
        """Number of the direction in which it is pressed, none for a law without one."""
        return None

    @property
    def open_at_rest(self) -> bool:
        """Nothing presses it at u = 0, so that nothing sticks."""
        return False

    @property
    def slider_intervals(self) -> tuple[SliderInterval, ...] | str:
        """Where each slider sticks, or why that is no interval, as the end of a sentence with its remedy."""
        return "has none: remove it, or use another law" if self.n_slider else ()

    def exported(self, program: str) -> "Joint":
        """The joint for export to other programs, as joints that these have.

        Parameters
        ----------
        program
            For messages, such as "NLvib".

        Raises
        ------
        ExchangeError
            They have no such law.
        """
        if self.nlvib is not None:
            return self
        raise ExchangeError(
            f'joint "{self.name}" is of the law "{self.kind}", which {program} does not have: remove it, or replace '
            "it by a law that exists there"
        )

    def pyharm(self, scale: float) -> Mapping[str, Any]:
        """Entries of its connector in pyHarm, for u = scale times the displacement there.

        Raises
        ------
        ExchangeError
            pyHarm has no such law.
        """
        del scale
        raise ExchangeError(f'joint "{self.name}" has no counterpart in pyHarm: remove it')

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """The joint with other values of some fields, or of some numbers of lists, such as "limit_force[0]"."""
        changed = dict(values)
        for parameter in self.parameters:
            if parameter.is_list and parameter.name not in changed:
                names = parameter.names(self)
                if any(name in changed for name in names):
                    own = zip(names, parameter.values(self), strict=True)
                    changed[parameter.name] = tuple(changed.pop(name, value) for name, value in own)
        return replace(self, **changed)  # type: ignore[type-var]

    @classmethod
    def build(cls, name: str, rows: Mapping[str, Row], values: Mapping[str, Any]) -> Self:
        """A joint from what a case file gives: rows by the names of `places`, values by parameter or option."""
        return cls(name=name, **rows, **values)  # type: ignore[call-arg]

    @classmethod
    def wrong(cls) -> str | None:
        """Contradiction in the data of the law, as the end of a sentence; checked when it is registered."""
        if not 0 < cls.typical_displacement < np.inf:
            return f"has typical_displacement = {cls.typical_displacement!r}: give a positive length in m"
        known = {field.name for field in fields(cls)}  # type: ignore[arg-type]
        for name in [*(item.name for item in cls.parameters), *(item.name for item in cls.options)]:
            if name not in known:
                return f'has a parameter "{name}", but no field of that name: add the field'
        return None


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectedJoint(Joint):
    """A joint along one row; its parameters are checked against their bounds.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, shape (r,) [-].

    Raises
    ------
    JointError
        A row that is not one, or a parameter that is not finite or outside its bounds.
    """

    name: str
    direction: Row

    def __post_init__(self) -> None:
        self.check_fields("direction")

    @property
    def directions(self) -> Rows:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]


#: All joint laws by their kind.
LAWS: Registry[type[Joint]] = Registry(
    "joint law",
    package="reduction.joint_law",
    group="stickslip.joint_laws",
    key="kind",
    facts={
        "parameters": "its numbers with units and bounds",
        "typical_displacement": "where its force bends",
        "directions": "the rows along which it acts",
        "n_slider": "how many numbers it remembers",
        "stuck_stiffness": "stiffness of each direction while it sticks",
        "spring_energy": "its elastic energy, None if it stores none",
    },
    check=lambda law: law.wrong(),
)
