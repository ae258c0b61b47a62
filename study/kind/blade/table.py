"""The tables of a blade: dimensions, material, mesh, clamp, reduction and damping."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, create_model
from pydantic_core import PydanticCustomError

from casefile.quantity import Angle, Length, MaterialDensity, Ratio, YoungsModulus
from casefile.table import CaseModel
from fe.element import REGISTRY
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade
from study.case.tables import StructureTable


def _known_element(name: str) -> str:
    if name not in REGISTRY:
        *others, last = (f"'{item}'" for item in REGISTRY.names())
        raise PydanticCustomError("literal_error", f"Input should be {', '.join(others)} or {last}")
    return name


Table = TypeVar("Table", bound=CaseModel)
Count = Annotated[int, Field(ge=1, le=1000, strict=True)]
#: Name of any registered element, including those of plugins.
ElementName = Annotated[str, AfterValidator(_known_element)]
BrickName = Literal["hex8", "hex20"]
RootName = Literal["full", "relaxed"]


def with_dimensions(part: type, *, are_given: bool = False) -> Callable[[type[Table]], type[Table]]:
    """Make a decorator of tables that adds the dimensions of a part of `geometry` as quantities.

    Parameters
    ----------
    part
        Dataclass of lengths [m], and of angles [rad], whose names end with "angle".
    are_given
        Whether a case must give all dimensions; otherwise the defaults are those of `geometry`.
    """

    def widened(table: type[Table]) -> type[Table]:
        sizes: dict[str, Any] = {
            field.name: (Angle if field.name.endswith("angle") else Length, ... if are_given else field.default)
            for field in fields(part)
        }
        return create_model(table.__name__, __base__=table, __doc__=table.__doc__, __module__=table.__module__, **sizes)

    return widened


@with_dimensions(Blade, are_given=True)
class RigBladeTable(CaseModel):
    """The rig's blade with its grooved pads."""

    kind: Literal["rig"]

    def blade(self) -> Blade:
        """Make the blade, and check its dimensions as a whole."""
        return Blade(**self.model_dump(exclude={"kind"}))


@with_dimensions(PlainBlade, are_given=True)
class PlainBladeTable(CaseModel):
    """The plain blade."""

    kind: Literal["plain"]

    def blade(self) -> PlainBlade:
        """Make the blade, and check its dimensions as a whole."""
        return PlainBlade(**self.model_dump(exclude={"kind"}))


BladeTable = Annotated[RigBladeTable | PlainBladeTable, Field(discriminator="kind")]


class MaterialTable(CaseModel):
    """Isotropic elastic material."""

    young: YoungsModulus
    poisson: Annotated[Ratio, Field(examples=[0.3])]
    density: MaterialDensity

    def material(self) -> Material:
        """Make the material, and check it."""
        return Material(young=self.young, poisson=self.poisson, density=self.density)


class PadTable(CaseModel):
    """Elements in the pads, see `fe.mesher.blade.PadMesh`."""

    along_contact: Count = 6
    across_groove: Count = 6
    across_lip: Count = 2
    above_groove: Count = 4
    band: Count = 2
    band_height: Length = 0.006

    def pads(self) -> PadMesh:
        """Make the parameters of the pads' mesh, and check them."""
        return PadMesh(**self.model_dump())


class MeshSizeTable(CaseModel):
    """The meshing rule without element and number of elements; `pads` apply only to the rig's blade."""

    length_ratio: Ratio
    length_cap: Length
    pads: PadTable = PadTable()


class MeshTable(MeshSizeTable):
    """The meshing rule of one model."""

    element: ElementName = "hex20"
    elements_through_thickness: Count = 2


class RootTable(CaseModel):
    """Relaxed clamp: every `drop_every`-th vertex node is left free."""

    drop_every: Annotated[int, Field(ge=2, strict=True)]


class ReductionTable(CaseModel):
    """Craig-Bampton reduction."""

    modes: Annotated[int, Field(ge=1, le=2000, strict=True)] = 150


class InteriorTable(CaseModel):
    """Craig-Bampton reduction, with any number of fixed-interface modes, or none."""

    modes: Annotated[int, Field(ge=0, le=2000, strict=True)] = 150


class DampingTable(CaseModel):
    """Rayleigh damping by the damping ratio of the first mode, and structural damping by a loss factor.

    The ratio is positive, since the peak would be infinite without damping, and limited, since damping shifts the peak.
    The loss factor eta gives a complex stiffness (1 + i eta) K.
    """

    ratio: Annotated[Ratio, Field(gt=0, le=0.2)] = 0.002
    loss_factor: Annotated[Ratio, Field(ge=0, lt=1)] = 0.0


class ReducedDampingTable(DampingTable):
    """Damping as in `DampingTable`; with only a loss factor there is no Rayleigh damping."""

    ratio: Annotated[Ratio, Field(gt=0, le=0.2)] | None = None  # type: ignore[assignment]

    @property
    def viscous_ratio(self) -> float | None:
        """Damping ratio of the first mode [-]; None for no Rayleigh damping."""
        if self.ratio is None and not self.loss_factor:
            return DampingTable().ratio
        return self.ratio


class BladeTables(CaseModel):
    """Tables that all cases of a blade have."""

    blade: BladeTable
    material: MaterialTable
    mesh: MeshSizeTable
    reduction: ReductionTable = ReductionTable()
    damping: DampingTable = DampingTable()


class BladeStructureTable(StructureTable, BladeTables):
    """``[structure]`` with ``kind = "blade"``: a model of a blade, fully clamped."""

    kind: Literal["blade"]
    mesh: MeshTable


def mesh_any(blade: Blade | PlainBlade, rule: MeshRule, pads: PadMesh) -> Mesh:
    """Mesh a blade of the rig or a plain blade."""
    if isinstance(blade, Blade):
        return mesh_blade(blade, rule, pads)
    return mesh_plain_blade(blade, rule)


def with_thickness(blade: Blade | PlainBlade, factor: float) -> Blade | PlainBlade:
    """Scale the thickness of a blade and of its edges; the root block becomes thicker by the same length."""
    thickness = blade.thickness * factor
    root_thickness = blade.root_thickness + thickness - blade.thickness
    if isinstance(blade, Blade):
        edge_thickness = blade.edge_thickness * factor
        return replace(blade, thickness=thickness, root_thickness=root_thickness, edge_thickness=edge_thickness)
    return replace(blade, thickness=thickness, root_thickness=root_thickness)
