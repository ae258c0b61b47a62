"""``[structure]`` with ``kind = "rig"``: dimensions of five bodies, their contacts and dead weights."""

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, pi, radians
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from casefile.quantity import Angle, Force, Length, Mass, MaterialDensity, Stiffness, YoungsModulus
from casefile.source import find_key_in_message, find_value
from casefile.table import CaseModel, located
from geometry.blade import Blade
from geometry.damper import Damper
from geometry.decoupler import Decoupler
from geometry.errors import GeometryError
from geometry.rig import Rig
from reduction.line_contact import Tangents
from study.case.joint_table import Friction
from study.case.tables import Case, StructureTable
from study.kind.blade.table import DampingTable, ElementName, MaterialTable, with_dimensions
from study.kind.rig.model import RigModel

#: Smallest and largest element size [m]: smaller elements exceed any memory, larger ones the length of a contact line.
FINEST, COARSEST = 1e-3, 10e-3
#: Largest gap of a contact line, whose surfaces are ground [m]. A larger value is a mistake of the unit; it would
#: rotate a damper beyond the range of a linear model.
WIDEST_GAP = 1e-4
#: Largest inclination of a laser beam [rad]; a beam at a larger angle mostly measures another direction.
LARGEST_INCLINATION = radians(80)
#: Largest angle between contact lines [rad]: `WIDEST_GAP` over a line of 1 mm; a larger value is a mistake of the unit.
WIDEST_ANGLE = 0.1


@with_dimensions(Blade)
class BladeDimensions(CaseModel):
    """Dimensions of the rig's blade and of the disc that the shaker pushes; `kind` is for tables of a blade's case."""

    kind: Literal["rig"] = "rig"
    excitation_radius: Length = Rig.excitation_radius

    def blade(self) -> Blade:
        """Make the blade, and check its dimensions as a whole."""
        return Blade(**self.model_dump(exclude={"kind", "excitation_radius"}))


@with_dimensions(Damper)
class DamperDimensions(CaseModel):
    """Dimensions of both dampers."""

    def damper(self) -> Damper:
        """Make a damper, and check its dimensions as a whole."""
        return Damper(**self.model_dump())


@with_dimensions(Decoupler)
class DecouplerDimensions(CaseModel):
    """Dimensions of both de-couplers."""

    def decoupler(self) -> Decoupler:
        """Make a de-coupler, and check its dimensions as a whole."""
        return Decoupler(**self.model_dump())


def _size(size: float) -> float:
    if not FINEST <= size <= COARSEST:
        raise ValueError(
            f'must lie between "{1e3 * FINEST:g} mm" and "{1e3 * COARSEST:g} mm": "2.5 mm" is a usual value'
        )
    return size


def _gap_angle(angle: float) -> float:
    if not abs(angle) <= WIDEST_ANGLE:
        raise ValueError(
            f'must lie between "{-degrees(WIDEST_ANGLE):.3g} deg" and "{degrees(WIDEST_ANGLE):.3g} deg": positive '
            "where the gap grows towards the damper's shoulder"
        )
    return angle


def _lean(angle: float) -> float:
    if not abs(angle) <= LARGEST_INCLINATION:
        raise ValueError('must lie between "-80 deg" and "80 deg": at 0 the beam is along y, positive towards +z')
    return angle


def _inclination(angle: float) -> float:
    if not abs(angle) < pi / 2:
        raise ValueError('must lie between "-90 deg" and "90 deg": at 0 the wire pulls straight up')
    return angle


Modes = Annotated[int, Field(ge=0, le=2000, strict=True, examples=[30])]
NotNegative = Annotated[Stiffness, Field(ge=0)]
Positive = Annotated[Stiffness, Field(gt=0)]
Gap = Annotated[Length, Field(ge=0, le=WIDEST_GAP)]
Width = Annotated[Length, Field(gt=0, examples=["3 mm"])]
Pull = Annotated[Force, Field(gt=0)]
GapAngle = Annotated[Angle, AfterValidator(_gap_angle), Field(examples=["0.35 deg"])]
Lean = Annotated[Angle, AfterValidator(_lean), Field(examples=["13 deg"])]
Inclination = Annotated[Angle, AfterValidator(_inclination)]


class RigMeshTable(CaseModel):
    """Elements of the same approximate size in all bodies."""

    element: ElementName = "hex20"
    size: Annotated[Length, AfterValidator(_size), Field(examples=["2.5 mm"])]


class BodyModes(CaseModel):
    """Number of fixed-interface modes of each body."""

    blade: Modes
    damper_left: Modes
    decoupler_left: Modes
    damper_right: Modes
    decoupler_right: Modes


def _form(value: Any) -> str:
    return "bodies" if isinstance(value, Mapping | BodyModes) else "together"


class RigReductionTable(CaseModel):
    """Craig-Bampton reduction: number of modes of all bodies together, the lowest first, or of each body."""

    modes: Annotated[Annotated[Modes, Tag("together")] | Annotated[BodyModes, Tag("bodies")], Discriminator(_form)] = (
        150
    )


class PairTable(CaseModel):
    """Parameters of one contact line; its gap varies linearly from the damper's end to its shoulder.

    The gap is given at both ends, or at the damper's end and by the angle between the lines.
    """

    kn: Positive | None = None
    kt: Positive | None = None
    mu: Friction | None = None
    crowning: Gap | None = None
    gap_start: Gap = 0.0
    gap_end: Gap | None = None
    gap_angle: GapAngle | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.gap_end is not None and self.gap_angle is not None:
            raise ValueError("gap_end and gap_angle both give the gap: remove one")
        return self

    @property
    def uneven(self) -> bool:
        """Whether the line has a linear gap."""
        return bool(self.gap_start or self.gap_end or self.gap_angle)


class ContactTable(CaseModel):
    """Stiffness and friction of each whole contact line; crowning is a gap at its ends that is zero in the middle."""

    kn: Positive
    kt: Positive
    mu: Friction
    crowning: Gap = 0.0
    tangents: Literal["along", "both"] = "along"
    left_blade: PairTable = PairTable()
    left_decoupler: PairTable = PairTable()
    right_blade: PairTable = PairTable()
    right_decoupler: PairTable = PairTable()

    @property
    def sliding(self) -> Tangents:
        """Tangents along which all lines can slide."""
        return Tangents(self.tangents)


class SideWeightTable(CaseModel):
    """Parameters of the dead weight of one side."""

    force: Pull | None = None
    width: Width | None = None
    shift: Length = 0.0
    inclination: Inclination = 0.0


class BladeMaterialTable(CaseModel):
    """Material of the blade; its Poisson's ratio is that of all bodies."""

    young: YoungsModulus | None = None
    density: MaterialDensity | None = None


class RigRootTable(CaseModel):
    """The clamp of the blade as a rigid body on springs, by their total stiffness along each axis; fixed by default."""

    stiffness: Positive | None = None


class AccelerometerTable(CaseModel):
    """The accelerometer at the blade's tip: a mass that moves with its node."""

    mass: Annotated[Mass, Field(ge=0, examples=["2 g"])] = 0.0


class StingerTable(CaseModel):
    """The stinger of the shaker: a spring along its axis from the excitation point to the ground."""

    stiffness: NotNegative = 0.0


class LaserTable(CaseModel):
    """The differential lasers: inclination of the beams to damper and blade from y towards +z."""

    damper: Lean = 0.0
    blade: Lean = 0.0


class WireTable(CaseModel):
    """Dead weights that pull the dampers up into their grooves by wires, over a width of the cylinder or all of it."""

    force: Pull = 55.0
    width: Width | None = None
    left: SideWeightTable = SideWeightTable()
    right: SideWeightTable = SideWeightTable()


class RigTable(StructureTable):
    """A rig, from its dimensions to its contacts."""

    kind: Literal["rig"]
    blade: BladeDimensions = BladeDimensions()
    damper: DamperDimensions = DamperDimensions()
    decoupler: DecouplerDimensions = DecouplerDimensions()
    material: MaterialTable
    blade_material: BladeMaterialTable = BladeMaterialTable()
    root: RigRootTable = RigRootTable()
    accelerometer: AccelerometerTable = AccelerometerTable()
    stinger: StingerTable = StingerTable()
    laser: LaserTable = LaserTable()
    mesh: RigMeshTable
    reduction: RigReductionTable = RigReductionTable()
    contact: ContactTable
    dead_weight: WireTable = WireTable()
    damping: DampingTable = DampingTable()


def make_rig_model(case: Case[RigTable]) -> RigModel:
    """Make and check the rig model of a case.

    Raises
    ------
    CaseError
        Bodies cannot be built or do not mate, or a material is impossible.
    """
    table = case.structure
    with located(case, "structure", "blade"):
        blade = table.blade.blade()
    with located(case, "structure", "damper"):
        damper = table.damper.damper()
    with located(case, "structure", "decoupler"):
        decoupler = table.decoupler.decoupler()
    with located(case, "structure", "material"):
        material = table.material.material()
    own = {name: value for name, value in table.blade_material.model_dump().items() if value is not None}
    with located(case, "structure", "blade_material"):
        blade_material = replace(material, **own)
    try:
        rig = Rig(blade=blade, damper=damper, decoupler=decoupler, excitation_radius=table.blade.excitation_radius)
    except GeometryError as error:
        with located(case, "structure", *_find_table_at_fault(case, str(error))):
            raise error
    modes = table.reduction.modes
    return RigModel(
        rig=rig,
        material=material,
        element=table.mesh.element,
        size=table.mesh.size,
        n_mode=modes if isinstance(modes, int) else modes.model_dump(),
        blade_material=blade_material,
        accelerometer_mass=table.accelerometer.mass,
        stinger_stiffness=table.stinger.stiffness,
        root_compliance=0.0 if table.root.stiffness is None else 1 / table.root.stiffness,
    )


def _find_table_at_fault(case: Case[RigTable], message: str) -> tuple[str, ...]:
    """Find the table in the file with a key that the message about bodies that do not mate names."""
    given = find_value({} if case.source is None else case.source.data, ("structure",))
    for table in ("damper", "decoupler", "blade"):
        if find_key_in_message(message, find_value(given, (table,)), {}):
            return (table,)
    return ()
