"""Data of every joint law, and the registry of all laws.

A law is a frozen dataclass derived from `Joint`: rows, numbers, and properties that the rest of the program uses
instead of the type of the law. `docs/extending.md` shows how to add a law.
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
    """Largest plausible value of a parameter; a larger number is probably a mistake."""

    largest: float
    remedy: str
    """Meaning of a larger number, and remedy, as the end of a sentence that begins with the number."""

    def doubt(self, value: float) -> str:
        """Warning about a number that is too large; empty otherwise."""
        return f"{value:g} {self.remedy}" if value > self.largest else ""


@dataclass(frozen=True, kw_only=True)
class LawParameter:
    """Parameter of a law in a case file.

    Parameters
    ----------
    name
        Name of the field.
    unit
        Unit as text that `study.quantity` can read, such as "N/m"; "-" for none.
    meaning
        Description in one line for tables and documents.
    typical
        Typical value for examples and sweeps over all laws.
    lower
        Smallest value; unbounded by default.
    positive
        Whether it must be larger than 0.
    plausible
        Plausible range for real joints; all values within the bounds by default.
    default
        Default value; None if the parameter must be given.
    is_list
        Whether it is a list of at least one number; its field is a tuple.
    is_form
        Whether it determines the form of the law, as an exponent does, and not its magnitude.
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
        """Name of the parameter, or of each number of a list, such as "limit_force[0]"."""
        if not self.is_list:
            return (self.name,)
        return tuple(f"{self.name}[{number}]" for number in range(len(getattr(joint, self.name))))

    def values(self, joint: "Joint") -> tuple[float, ...]:
        """Value of the parameter, or the numbers of a list."""
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
    """Option of a law in a case file: one of several words.

    Parameters
    ----------
    name
        Name of the field.
    choices
        Possible words; the first is the default.
    meaning
        Description in one line for tables and documents.
    """

    name: str
    choices: tuple[str, ...]
    meaning: str


class MachineCode(Protocol):
    """Compiled function of a user, see `reduction.joint_law.function_law.CompiledFunction`."""

    @property
    def address(self) -> int:
        """Address in this process."""


class SliderInterval(NamedTuple):
    """Slider that sticks while abs(k_t (u - w)) <= constant + by_normal v."""

    tangent: int
    """Number of the direction of u."""
    normal: int
    """Number of the direction of v, -1 for none."""
    stiffness: float
    """Stiffness k_t [N/m]."""
    constant: float
    """Constant part of the limit, mu (N_0 - k_n g), or the constant limit [N]."""
    by_normal: float
    """Slope of the limit, mu k_n; 0 for a constant limit [N/m]."""


class Joint(ABC):
    """Joint: a nonlinear force along rows over the degrees of freedom of a structure.

    A law must define all attributes without a default; otherwise the registry refuses it. Defaults hold for laws that
    do not override them, or raise an error.
    """

    kind: ClassVar[str]
    """Name of the law in registries and case files."""
    parameters: ClassVar[tuple[LawParameter, ...]]
    """Parameters in the order in which the force reads them; each is a field."""
    typical_displacement: ClassVar[float]
    """Displacement at which the law is nonlinear, with the typical parameters [m]."""
    options: ClassVar[tuple[LawOption, ...]] = ()
    """Options; each is a field."""
    places: ClassVar[Mapping[str, bool]] = {"direction": True}
    """Names of the rows in a case file, and whether each must be given."""
    series_springs: ClassVar[bool] = False
    """Whether the elastic energy of each direction is force^2 / (2 stuck stiffness) for any motion; for the normal
    direction it is taken about the mean displacement, as for every spring that may open."""
    can_slip: ClassVar[bool] = True
    """Whether the joint may slip; a stop can only be closed or open."""
    one_sided: ClassVar[bool] = False
    """Whether the force at -u is not minus the force at u, so that the sign of the row matters."""
    nlvib: ClassVar[tuple[str, Mapping[str, str]] | None] = None
    """Type of the element in NLvib, and field for each of NLvib's names of numbers; None for a law that other programs
    do not have."""

    function: ClassVar[MachineCode | None] = None
    """User's function for the force, called by its address; None for a law whose force is part of `hbsolve`."""

    name: str

    def check_fields(self, *rows: str) -> None:
        """Replace the named rows by read-only copies and all scalars by floats, and check the parameters.

        Entries that are not finite real numbers, a row of zeros or of another shape, and a parameter outside its bounds
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
        """List of numbers of a field; a single number is a list of one."""
        what = f'joint "{self.name}": {name}'
        values = np.atleast_1d(check_array(getattr(self, name), what, JointError))
        if values.ndim != 1 or not values.size:
            raise JointError(f"{what} has shape {values.shape}: give a list of at least one number")
        return tuple(check_finite_number(value, f"{what}[{number}]", JointError) for number, value in enumerate(values))

    @property
    @abstractmethod
    def directions(self) -> Rows:
        """Rows along which the joint acts, shape (d, r) [-]."""

    @property
    @abstractmethod
    def n_slider(self) -> int:
        """Number of state variables: sliders, or others [-]."""

    @property
    @abstractmethod
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness of each direction while stuck and closed; 0 for a joint without one at rest, shape (d,) [N/m]."""

    @abstractmethod
    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row | None:
        """Elastic energy of the vibration at each instant, shape (n,) [J]; None for a law that stores none.

        Parameters
        ----------
        parameters
            Values by name; along a branch over a parameter they differ from those of the joint.
        displacement
            Displacement of each direction, shape (d, n) [m].
        force
            Force of each direction without its mean, shape (d, n) [N].
        slider
            State variables, shape (s, n).
        """

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters in the order in which the force reads them; each number of a list has a name."""
        return tuple(name for parameter in self.parameters for name in parameter.names(self))

    @property
    def parameter_values(self) -> tuple[float, ...]:
        """Values of the parameters, in the order of `parameter_names`."""
        return tuple(value for parameter in self.parameters for value in parameter.values(self))

    @property
    def force_law(self) -> str:
        """Name of the compiled force; a class may have several."""
        return self.kind

    @property
    def reference_stiffness(self) -> tuple[float, ...]:
        """Stiffness of each direction in the linear part of the harmonic balance, D of eq. 12, shape (d,) [N/m]."""
        return self.stuck_stiffness

    @property
    def stuck_force(self) -> tuple[float, ...]:
        """Force of each direction at u = 0 while stuck and closed, shape (d,) [N]."""
        return (0.0,) * len(self.stuck_stiffness)

    @property
    def normal_direction(self) -> int | None:
        """Number of the normal direction, None for a law without a normal."""
        return None

    @property
    def open_at_rest(self) -> bool:
        """Whether the normal force is zero at u = 0, so that nothing sticks."""
        return False

    @property
    def slider_intervals(self) -> tuple[SliderInterval, ...] | str:
        """Sticking interval of each slider, or the reason why there is none, as the end of a sentence with remedy."""
        return "has none: remove it, or use another law" if self.n_slider else ()

    def exported(self, program: str) -> "Joint":
        """Equivalent joint that exists in other programs, for export.

        Parameters
        ----------
        program
            Name of the program for messages, such as "NLvib".

        Raises
        ------
        ExchangeError
            Other programs do not have this law.
        """
        if self.nlvib is not None:
            return self
        raise ExchangeError(
            f'joint "{self.name}" is of the law "{self.kind}", which {program} does not have: remove it, or replace '
            "it by a law that exists there"
        )

    def pyharm(self, scale: float) -> Mapping[str, Any]:
        """Entries of the connector in pyHarm, for u = scale times the displacement in pyHarm.

        Raises
        ------
        ExchangeError
            pyHarm does not have this law.
        """
        del scale
        raise ExchangeError(f'joint "{self.name}" has no counterpart in pyHarm: remove it')

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """Joint with other values of some fields, or of some numbers of lists, such as "limit_force[0]"."""
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
        """Joint from the entries of a case file: rows by the names of `places`, values by parameter or option."""
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
    """Joint along one row; its parameters are checked against their bounds.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].

    Raises
    ------
    JointError
        An invalid row, or a parameter that is not finite or outside its bounds.
    """

    name: str
    direction: Row

    def __post_init__(self) -> None:
        self.check_fields("direction")

    @property
    def directions(self) -> Rows:
        """Row of u, shape (1, r) [-]."""
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
