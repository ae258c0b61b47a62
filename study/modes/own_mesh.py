"""Options of ``stickslip modes`` for a mesh file (unit, supports, material), and the mesh and material from them."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from geometry.errors import InputError, InputWarning

if TYPE_CHECKING:
    from casefile.quantity import Dimension
    from fe.material import Material
    from fe.mesh import Mesh
    from study.run_context import RunContext

REMEDY = "give --young, --poisson and --density"


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class OwnMesh:
    """Options for the unit, material and supports of a mesh file, as the user typed them."""

    fix: Annotated[tuple[str, ...], Parameter(help="Fixed node or face set; may be repeated.", negative="")] = ()
    free: Annotated[bool, Parameter(help="The mesh has no support.", negative="")] = False
    length_unit: Annotated[str | None, Parameter(help="Unit of the mesh file's coordinates, such as mm.")] = None
    young: Annotated[
        str | None,
        Parameter(help="Young's modulus; default: that of the file, or 210 GPa.", allow_leading_hyphen=True),
    ] = None
    poisson: Annotated[float | None, Parameter(help="Poisson's ratio; default: that of the file, or 0.3.")] = None
    density: Annotated[
        str | None, Parameter(help="Density; default: that of the file, or 7800 kg/m^3.", allow_leading_hyphen=True)
    ] = None

    @property
    def is_given(self) -> bool:
        """Whether an option is given that only a mesh file needs."""
        return bool(self.fix or self.free or self.length_unit is not None)

    def read(self, source: Path, run: "RunContext") -> "tuple[Mesh, Material]":
        """Read the mesh of a file and make the material, with a warning if options replace the material of the file.

        Raises
        ------
        InputError
            If an option is missing, invalid or contradicts another.
        """
        import numpy as np

        from casefile.quantity import LENGTH
        from fe.errors import SupportError
        from fe.file.mesh_file import read_mesh
        from study.case.model_doubt import warn_of_linear_cells, warn_of_seams, warn_of_size

        if not source.is_file():
            raise InputError(
                f"mesh file {source} cannot be read: there is no such file; check the spelling and the folder"
            )
        if self.length_unit is None:
            raise InputError(f"{source}: the unit of its coordinates is not given: add, for example, --length-unit mm")
        unit = _read_typed("--length-unit", self.length_unit, LENGTH, number="1 ")
        material = self._material(source, unit, run)
        mesh = read_mesh(source, length_unit_in_metre=unit)
        known = ", ".join(sorted({*mesh.node_sets, *mesh.face_sets})) or "no sets"
        warn_of_size(float(np.ptp(mesh.points, axis=0).max()), unit)
        if self.free and self.fix:
            raise SupportError("--free and --fix contradict each other: remove one")
        if not self.free and not self.fix:
            raise SupportError(f"{source} has no support: name a set with --fix (it has {known}), or give --free")
        for name in self.fix:
            if name not in mesh.node_sets and name not in mesh.face_sets:
                raise SupportError(f"--fix {name}: {source} has no such set, it has {known}")
        warn_of_linear_cells(mesh, str(source))
        warn_of_seams(mesh, str(source))
        return mesh, material

    def _material(self, source: Path, unit: float, run: "RunContext") -> "Material":
        """Material from the options; values without an option are those of the file, else those of steel."""
        from casefile.quantity import MATERIAL_DENSITY, YOUNGS_MODULUS
        from fe.file.file_material import describe_material, list_differences, read_file_material
        from fe.material import STEEL, Material
        from study.carried_material import check_carried_material, use_carried_material

        given = (self.young, self.poisson, self.density)
        carried = read_file_material(source, unit)
        base, has_material = STEEL, carried.material is not None or carried.obstacle
        if has_material and not any(value is not None for value in given):
            base = use_carried_material(str(source), carried, unit, REMEDY, run)
        elif has_material and None in given:
            base = check_carried_material(str(source), carried, unit, REMEDY)
        young = base.young if self.young is None else _read_typed("--young", self.young, YOUNGS_MODULUS)
        density = base.density if self.density is None else _read_typed("--density", self.density, MATERIAL_DENSITY)
        poisson = base.poisson if self.poisson is None else self.poisson
        try:
            material = Material(young=young, poisson=poisson, density=density)
        except InputError as error:  # its text begins with the name of the field, which is that of the option
            name, _, value = str(error).partition(" = ")
            raise InputError(f"--{name} {value}") from None
        if carried.material is not None and (names := list_differences(material, carried.material)):
            warnings.warn(
                f"{source} contains a material of {describe_material(carried.material, unit)}, whose "
                f"{' and '.join(names)} the options replace",
                InputWarning,
                stacklevel=3,
            )
        return material


#: Default of the commands; it is immutable, so that all can use one object.
NO_MESH = OwnMesh()


def _read_typed(option: str, text: str, dimension: "Dimension", number: str = "") -> float:
    from casefile.quantity import read_quantity

    try:
        value = read_quantity(number + text, dimension)
    except ValueError as error:
        raise InputError(f'{option} "{text}": {error}') from None
    doubt = dimension.plausibility.doubt(value, text) if dimension.plausibility else ""
    if doubt:
        warnings.warn(f'{option} "{text}": {doubt}', InputWarning, stacklevel=3)
    return value
