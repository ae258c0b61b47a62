"""The material in a mesh file: its values are checked, reported and used."""

from casefile.plausibility import MATERIAL_DENSITY, YOUNGS_MODULUS
from fe.errors import MeshError
from fe.file.file_material import CarriedMaterial, describe_material
from fe.material import Material
from study.run_context import RunContext


def check_carried_material(file: str, carried: CarriedMaterial, length_unit: float, remedy: str) -> Material:
    """Return the material of a mesh file if its values are possible for a solid.

    Parameters
    ----------
    file
        Name of the mesh file, for messages.
    carried
        Material in the file.
    length_unit
        Unit of length of the coordinates in the file [m].
    remedy
        Where the user can give a material, as an imperative clause.

    Raises
    ------
    MeshError
        The file has no usable material.
    """
    if carried.material is None:
        why = f"{carried.obstacle}: " if carried.obstacle else f"{file} contains no material: "
        raise MeshError(why + remedy)
    material = carried.material
    values = ((material.young, YOUNGS_MODULUS), (material.density, MATERIAL_DENSITY))
    refusals = [words for value, check in values if (words := check.refusal(value, None))]
    if refusals:
        content = describe_material(material, length_unit)
        raise MeshError(
            f"the material {carried.name} of {file} is {content}: {refusals[0]}; if the file has other units, {remedy}"
        )
    return material


def use_carried_material(
    file: str, carried: CarriedMaterial, length_unit: float, remedy: str, run: RunContext
) -> Material:
    """Do `check_carried_material`, report the values as a note, and warn of unusual ones; `run` prints both."""
    material = check_carried_material(file, carried, length_unit, remedy)
    run.note(f"the material {carried.name} of {file} is used: {describe_material(material, length_unit)}")
    for value, check in ((material.young, YOUNGS_MODULUS), (material.density, MATERIAL_DENSITY)):
        if doubt := check.doubt(value, None):
            run.warn(f"the material {carried.name} of {file}: {doubt}")
    return material
