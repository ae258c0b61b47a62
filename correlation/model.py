"""Model of a test: a jointed system with its places, sensors and contact lines.

Effects change it: parts get lighter, springs are added, a sensor reads too much. Loads are those of a level of 1 N; the
level of a test scales the harmonic force alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.dead_weight import DeadWeight, Wire
from correlation.errors import ModelDefinitionError
from correlation.sensor import COMPONENTS, DERIVATIVE, AnySensor, Head, LineSensor, LoadCell, Row, Sensor
from geometry.read_only_array import freeze_fields, read_only
from hbsolve.coupled_damping import split_proportional_plus_low_rank
from reduction.elastic_support import ElasticBody
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import FrictionContact, JointedSystem

__all__ = [
    "COMPONENTS", "DERIVATIVE", "DIRECTIONS", "AnySensor", "DeadWeight", "Dof", "Head", "LineSensor", "LoadCell",
    "Matrix", "Model", "Row", "Sensor", "StructurePart", "Wire",
]  # fmt: skip

Matrix = Float[NDArray[np.float64], "r r"]

TRANSLATIONS, ROTATIONS = ("x", "y", "z"), ("rx", "ry", "rz")
DIRECTIONS = (*TRANSLATIONS, *ROTATIONS, "modal")


@dataclass(frozen=True, kw_only=True, eq=False)
class Dof:
    """Degree of freedom.

    Parameters
    ----------
    body, node
        Body and number of its node.
    direction
        "x", "y", "z", "rx", "ry", "rz"; "modal" for one that is no motion of a point.
    coordinates
        Coordinates of the point, shape (3,) [m]; none if it is no point or not known.
    """

    body: str = "structure"
    node: int = 0
    direction: str = "modal"
    coordinates: Float[NDArray[np.float64], "3"] | None = None

    def __post_init__(self) -> None:
        if self.direction not in DIRECTIONS:
            raise ModelDefinitionError(f'direction "{self.direction}" is none of {", ".join(DIRECTIONS)}')


@dataclass(frozen=True, kw_only=True, eq=False)
class StructurePart:
    """A named share of the structure's mass and stiffness, each of shape (r, r) [kg, N/m]."""

    name: str
    mass: Matrix
    stiffness: Matrix

    def __post_init__(self) -> None:
        freeze_fields(self, "mass", "stiffness")


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """A model with its test set-up.

    Parameters
    ----------
    system
        Structure, joints, and loads for a level of 1 N.
    sensors
        Sensors.
    parts
        Shares of mass and stiffness; one, "all", by default.
    dofs
        Descriptions of the degrees of freedom; unknown by default.
    lines
        Contacts of each line, in order along it, by their names.
    joint_groups
        Names of the other joints of each component, by its name: one joint, or one at each node of a lap. The system of
        a test may lack them.
    places
        Named points with a direction, as rows of displacement: where an effect may act.
    load_cells
        Load cells that the structure has, by name: sensors of a campaign may be these.
    dead_weights
        Dead weights that press lines, by name; static load and preloads of the system contain them already.
    elastic_bodies
        Parts on a support that may give way, by the name of the part; system and parts contain their matrices.
    linked_preloads
        Groups of `preloads` that one screw sets: from one assembly to the next they differ by one factor. All others
        differ by themselves.
    suspension
        Stiffness that holds the structure when its contacts are taken away for a test, shape (r, r) [N/m]; none by
        default.
    frequency_shift
        Relative shift of the true frequency of a test above the stated one, by configuration, "jointed" or "free"; none
        by default [-].
    force_error
        Relative excess of the force of a test over the stated one, by configuration; none by default [-].
    base_acceleration
        Acceleration that a shaken base gives each degree of freedom at level 1 as if the structure were rigid, row k
        for harmonic k, shape (n, r) [m/s^2]; a single row of shape (r,) is harmonic 1. The system moves relative to
        the base under the inertia load, which its harmonic force contains. None for a base that rests.
    level_power
        The level is times Omega^level_power: 2 if the case gives the displacement of the base, 1 for its velocity, 0
        for accelerations and forces [-].
    n_harmonic, n_sample
        H + 1, and instants per period (0 leaves them to the balance) [-].

    Raises
    ------
    ModelDefinitionError
        A row, part or table of another size than the structure, a line without its contacts, two sensors of one name,
        a group of preloads that is empty, names none, or shares one with another.
    """

    system: JointedSystem
    sensors: tuple[AnySensor, ...]
    parts: tuple[StructurePart, ...] = ()
    dofs: tuple[Dof, ...] = ()
    lines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    joint_groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    places: Mapping[str, Row] = field(default_factory=dict)
    load_cells: Mapping[str, LoadCell] = field(default_factory=dict)
    dead_weights: Mapping[str, DeadWeight] = field(default_factory=dict)
    elastic_bodies: Mapping[str, ElasticBody] = field(default_factory=dict)
    linked_preloads: tuple[tuple[str, ...], ...] = ()
    suspension: Matrix | None = None
    frequency_shift: Mapping[str, float] = field(default_factory=dict)
    force_error: Mapping[str, float] = field(default_factory=dict)
    base_acceleration: Row | Complex[NDArray[np.complex128], "n r"] | None = None
    level_power: int = 0
    n_harmonic: int = 8
    n_sample: int = 0

    def __post_init__(self) -> None:
        r = self.system.n_dof
        if not self.parts:
            whole = StructurePart(name="all", mass=self.system.mass, stiffness=self.system.stiffness)
            object.__setattr__(self, "parts", (whole,))
        if not self.dofs:
            object.__setattr__(self, "dofs", (Dof(),) * r)
        object.__setattr__(self, "lines", {line: tuple(names) for line, names in self.lines.items()})
        groups = {group: tuple(names) for group, names in self.joint_groups.items()}
        object.__setattr__(self, "joint_groups", groups)
        object.__setattr__(self, "places", {name: read_only(row) for name, row in self.places.items()})
        object.__setattr__(self, "load_cells", dict(self.load_cells))
        object.__setattr__(self, "dead_weights", dict(self.dead_weights))
        object.__setattr__(self, "elastic_bodies", dict(self.elastic_bodies))
        object.__setattr__(self, "linked_preloads", tuple(tuple(group) for group in self.linked_preloads))
        object.__setattr__(self, "sensors", tuple(self.sensors))
        if self.base_acceleration is not None:
            given = np.asarray(self.base_acceleration)
            rows = given if given.ndim == 2 else np.stack([np.zeros_like(given), given])
            object.__setattr__(self, "base_acceleration", read_only(rows, kind=np.complex128))
        self._check(r)

    def _check(self, r: int) -> None:
        if len(self.dofs) != r:
            raise ModelDefinitionError(f"{len(self.dofs)} degrees of freedom are described, the structure has {r}")
        rows = {f'place "{name}"': row for name, row in self.places.items()}
        rows |= {f'sensor "{item.name}"': item.row for item in self.sensors if not isinstance(item, LineSensor)}
        rows |= {f'load cell "{name}"': item.row for name, item in self.load_cells.items()}
        rows |= {} if self.base_acceleration is None else {"base_acceleration": self.base_acceleration[1]}
        rows |= {f'dead weight "{name}"': item.row for name, item in self.dead_weights.items()}
        for what, row in rows.items():
            if row.shape != (r,):
                raise ModelDefinitionError(f"{what} has a row of shape {row.shape}: give ({r},), one number per DOF")
        for part in self.parts:
            if part.mass.shape != (r, r) or part.stiffness.shape != (r, r):
                raise ModelDefinitionError(f'part "{part.name}" has matrices of another size than ({r}, {r})')
        names = [item.name for item in self.sensors]
        for name in names:
            if names.count(name) > 1:
                raise ModelDefinitionError(f'two sensors are called "{name}": give each its own name')
        contacts = {joint.name for joint in list_friction_contacts(self.system.joints)}
        for line, members in self.lines.items():
            for member in members:
                if member not in contacts:
                    raise ModelDefinitionError(
                        f'line "{line}" has no contact "{member}": the system has {", ".join(contacts)}'
                    )
        for name, weight in self.dead_weights.items():
            if not weight.row.any() or not weight.lines:
                raise ModelDefinitionError(
                    f'dead weight "{name}" is zero or presses no line: give its load and its lines'
                )
            for line in weight.lines:
                if line not in self.lines:
                    raise ModelDefinitionError(
                        f'dead weight "{name}" presses line "{line}", which the model does not have'
                    )
            if name in self.lines:
                raise ModelDefinitionError(f'a dead weight and a line are both called "{name}": rename one')
        for item in self.sensors:
            if isinstance(item, LineSensor) and item.line not in self.lines:
                raise ModelDefinitionError(
                    f'sensor "{item.name}" reads line "{item.line}", which the model does not have'
                )
        together = [name for group in self.linked_preloads for name in group]
        if not all(self.linked_preloads):
            raise ModelDefinitionError(
                "a group of preloads that are pressed together is empty: name them, or leave it out"
            )
        for name in together:
            if name not in self.preloads:
                raise ModelDefinitionError(
                    f'"{name}" is pressed together with others, but is not a preload of the model: there are '
                    f"{', '.join(self.preloads) or 'none'}"
                )
            if together.count(name) > 1:
                raise ModelDefinitionError(f'"{name}" is pressed together with others twice: name it once')

    @property
    def preloads(self) -> tuple[str, ...]:
        """Names of independent preloads: dead weights, and lines that none of them presses."""
        pressed = {line for weight in self.dead_weights.values() for line in weight.lines}
        return (*self.dead_weights, *(line for line in self.lines if line not in pressed))

    @property
    def preload_groups(self) -> tuple[tuple[str, ...], ...]:
        """All `preloads` in groups with a common factor: `linked_preloads`, and each of the others."""
        together = {name for group in self.linked_preloads for name in group}
        return (*self.linked_preloads, *((name,) for name in self.preloads if name not in together))

    def preload_slope(self, name: str) -> tuple[Row, dict[str, float]]:
        """Change by 100 % more of one of `preloads`: static load, shape (r,) [N], and preloads by contact [N].

        A dead weight moves the bodies and so presses the contacts: only the load changes. Bolts and the like press a
        line where it is: with its preloads the load that balances them.
        """
        if name in self.dead_weights:
            return self.dead_weights[name].row, {}
        members = [self.contact(item) for item in self.lines.get(name, ())]
        static = np.sum([item.preload * item.normal for item in members] or [np.zeros(self.system.n_dof)], axis=0)
        return static, {item.name: item.preload for item in members}

    def with_preload_ratio(self, name: str, ratio: float) -> "Model":
        """The model with one of `preloads` times a ratio.

        Raises
        ------
        ModelDefinitionError
            Another name.
        """
        if name not in self.preloads:
            raise ModelDefinitionError(
                f'"{name}" is not a preload of the model: there are {", ".join(self.preloads) or "none"}'
            )
        static, preloads = self.preload_slope(name)
        changed = self.with_joints(
            {item: {"preload": self.contact(item).preload + (ratio - 1) * slope} for item, slope in preloads.items()}
        )
        weights = dict(self.dead_weights)
        if name in weights:
            before = weights[name]
            wire = None if before.wire is None else replace(before.wire, force=ratio * before.wire.force)
            weights[name] = replace(before, row=ratio * before.row, wire=wire)
        return replace(changed.with_system(static_load=self.system.static + (ratio - 1) * static), dead_weights=weights)

    def with_wire(self, name: str, *, shift: float = 0.0, inclination: float = 0.0) -> "Model":
        """The model with the wire of a dead weight moved and turned by an increment [m, rad].

        Raises
        ------
        ModelDefinitionError
            No such dead weight, or one without a wire.
        """
        if not (shift or inclination):
            return self
        weight = self.dead_weights.get(name)
        if weight is None or weight.wire is None:
            known = [item for item, weight in self.dead_weights.items() if weight.wire is not None]
            raise ModelDefinitionError(
                f'"{name}" is not a dead weight on a wire of the model: there are {", ".join(known) or "none"}'
            )
        wire = replace(weight.wire, shift=weight.wire.shift + shift, inclination=weight.wire.inclination + inclination)
        changed = DeadWeight.on_wire(wire, weight.lines)
        loaded = self.with_system(static_load=self.system.static + changed.row - weight.row)
        return replace(loaded, dead_weights={**self.dead_weights, name: changed})

    def with_elastic_body(self, name: str, body: ElasticBody) -> "Model":
        """The model with one of its `elastic_bodies` changed: its matrices take the place of those before."""
        mass, stiffness = self.system.mass, self.system.stiffness
        before, after = self.elastic_bodies[name].matrices, body.matrices
        changed = self.with_material(mass + (after[0] - before[0]), stiffness + (after[1] - before[1]))
        return replace(changed, elastic_bodies={**self.elastic_bodies, name: body})

    def without_contacts(self) -> "Model":
        """The same structure without the contacts of its lines and the static load that balances them, suspended."""
        members = {name for line in self.lines.values() for name in line}
        joints = [joint for joint in self.system.joints if joint.name not in members]
        sensors = tuple(item for item in self.sensors if isinstance(item, Sensor))
        suspended = self
        if self.suspension is not None:
            # Damping in proportion to the suspension as well, so that modes uncouple it.
            suspended = self.with_material(self.system.mass, self.system.stiffness + self.suspension)
        system = replace(suspended.system, joints=joints, static_load=np.zeros(self.system.n_dof))
        return replace(
            self, system=system, sensors=sensors, lines={}, dead_weights={}, linked_preloads=(), suspension=None
        )

    def in_configuration(self, configuration: str) -> "Model":
        """The structure as a test has it: "jointed", or "free" of all contacts."""
        return self.without_contacts() if configuration == "free" else self

    def with_system(self, **changes: Any) -> "Model":
        """Other matrices, joints or loads; on a shaken base another mass has another inertia load."""
        if self.base_acceleration is not None and "mass" in changes and "harmonic_force" not in changes:
            force = np.array(self.system.dynamic)
            force[: len(self.base_acceleration)] -= self.base_acceleration @ (changes["mass"] - self.system.mass).T
            changes["harmonic_force"] = force
        return replace(self, system=replace(self.system, **changes))

    def with_material(self, mass: Matrix, stiffness: Matrix) -> "Model":
        """The model with the mass and stiffness of another material of its parts.

        Damping alpha M + beta K follows both matrices, so that modes uncouple it as before; discrete dashpots stay. The
        ratio of a mode whose damping is half from mass and half from stiffness is kept to first order. Any damping that
        `split_proportional_plus_low_rank` does not find proportional stays, as of a dashpot on modal coordinates: apply
        materials before such effects.
        """
        system = self.system
        proportional = split_proportional_plus_low_rank(system.mass, system.damping, system.stiffness)
        damping = system.damping
        if proportional is not None:
            damping = (
                damping
                + proportional.mass_factor * (mass - system.mass)
                + proportional.stiffness_factor * (stiffness - system.stiffness)
            )
        return self.with_system(mass=mass, damping=damping, stiffness=stiffness)

    def with_drive(self, factor: float) -> "Model":
        """The model with its loads at level 1 multiplied by a factor."""
        base = None if self.base_acceleration is None else factor * self.base_acceleration
        return replace(self.with_system(harmonic_force=factor * self.system.dynamic), base_acceleration=base)

    def with_joints(self, change: Mapping[str, Mapping[str, float]]) -> "Model":
        """Other parameters of some joints, by their names."""
        joints = [joint.with_values(change.get(joint.name, {})) for joint in self.system.joints]
        return self.with_system(joints=joints)

    def with_frequency_shift(self, configuration: str, shift: float) -> "Model":
        """The frequencies of one configuration raised by a share more."""
        known = self.frequency_shift
        return replace(self, frequency_shift={**known, configuration: known.get(configuration, 0.0) + shift})

    def with_force_error(self, configuration: str, error: float) -> "Model":
        """The force of one configuration larger by a share more."""
        known = self.force_error
        return replace(self, force_error={**known, configuration: known.get(configuration, 0.0) + error})

    def with_sensor(self, name: str, **changes: Any) -> "Model":
        """The model with one sensor replaced."""
        sensors = tuple(replace(item, **changes) if item.name == name else item for item in self.sensors)
        return replace(self, sensors=sensors)

    def contact(self, name: str) -> FrictionContact:
        """A contact by its name.

        Raises
        ------
        ModelDefinitionError
            There is none.
        """
        for contact in list_friction_contacts(self.system.joints):
            if contact.name == name:
                return contact
        raise ModelDefinitionError(f'there is no contact "{name}"')
