"""Material in a mesh file, such as an Abaqus deck or Nastran bulk data.

A file contains no units. With forces in N, times in s and the file's unit of length, moduli are in N per length squared
and densities in N s^2 per length to the fourth power, such as MPa and tonne/mm^3 for millimetres. With inches or feet,
forces are in lbf, so that moduli with inches are in psi.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_file import make_opening_error
from fe.file.registry import FileMaterial, format_of, suffixes
from fe.material import Material
from geometry.errors import InputError

#: Relative difference up to which two values are equal except for their number of digits.
SAME_VALUE = 1e-3
#: Names of units of length in messages.
LENGTH_UNITS = {1.0: "m", 1e-2: "cm", 1e-3: "mm", 1e-6: "um", 0.0254: "inch", 0.3048: "ft"}
#: Unit of force for a unit of length, in newtons and by name; the newton for all other units of length.
FORCE_UNITS = dict.fromkeys((0.0254, 0.3048), (4.4482216152605, "lbf"))


@dataclass(frozen=True, kw_only=True)
class CarriedMaterial:
    """Material in a mesh file.

    Parameters
    ----------
    material
        The only material of the solid cells; None if the file has no usable material.
    name
        Name of the material in the file.
    obstacle
        Reason why no material can be used, as a sentence; empty if the material is usable or the file has none.
    """

    material: Material | None = None
    name: str = ""
    obstacle: str = ""


def read_file_material(path: str | PathLike[str], length_unit_in_metre: float) -> CarriedMaterial:
    """Read the material of a mesh file.

    Parameters
    ----------
    path
        Mesh file; the result is empty for formats without materials.
    length_unit_in_metre
        Unit of the coordinates in the file [m].

    Raises
    ------
    MeshError
        A material that cannot be read.
    """
    file = Path(path)
    if file.suffix.lower() not in suffixes(MESH_FORMATS) or not file.is_file():
        return CarriedMaterial()
    read = format_of(MESH_FORMATS, file).materials
    try:
        result = () if read is None else read(file)
    except OSError as error:
        raise make_opening_error(file, error) from error
    if not result:
        return CarriedMaterial()
    names = " and ".join(f'"{item.name}"' for item in result)
    if len(result) > 1 and not all(_is_same(item, result[0]) for item in result):
        return CarriedMaterial(obstacle=f"{file.name} has the materials {names}, but a part has only one")
    only = result[0]
    missing = [name for name in ("young", "poisson", "density") if getattr(only, name) is None]
    if only.obstacle or missing:
        return CarriedMaterial(
            name=only.name,
            obstacle=f"{file.name}: material {names} {only.obstacle or 'has no ' + ' and no '.join(missing)}",
        )
    assert only.young is not None
    assert only.poisson is not None
    assert only.density is not None
    force, _ = _force_unit(length_unit_in_metre)
    try:
        material = Material(
            young=only.young * force / length_unit_in_metre**2,
            poisson=only.poisson,
            density=only.density * force / length_unit_in_metre**4,
        )
    except InputError as error:
        raise MeshError(f"mesh file {file}: material {names}: {error}") from error
    return CarriedMaterial(material=material, name=only.name)


def describe_material(material: Material, length_unit_in_metre: float) -> str:
    """Values of a material from a file as text, with the units that were assumed."""
    unit = LENGTH_UNITS.get(length_unit_in_metre, f"{length_unit_in_metre:g} m")
    values = f"{material.young / 1e9:.4g} GPa, {material.poisson:.4g}, {material.density:.5g} kg/m^3"
    return f"{values} (read in {_force_unit(length_unit_in_metre)[1]}, {unit} and s)"


def _force_unit(length_unit_in_metre: float) -> tuple[float, str]:
    return FORCE_UNITS.get(length_unit_in_metre, (1.0, "N"))


def list_differences(given: Material, carried: Material) -> Sequence[str]:
    """Names of the values that differ by more than `SAME_VALUE`."""
    return [
        name
        for name in ("young", "poisson", "density")
        if abs(getattr(given, name) - getattr(carried, name)) > SAME_VALUE * abs(getattr(carried, name))
    ]


def _is_same(one: FileMaterial, other: FileMaterial) -> bool:
    values = [(item.young, item.poisson, item.density, item.obstacle) for item in (one, other)]
    return values[0] == values[1]
