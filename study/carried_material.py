"""The material that a mesh file carries, used with a note of its values if they can be those of a solid."""

from casefile.plausibility import MATERIAL_DENSITY, YOUNGS_MODULUS
from fe.errors import MeshError
from fe.file.file_material import CarriedMaterial, describe_material
from fe.material import Material
from study.run_context import RunContext


def check_carried_material(file: str, carried: CarriedMaterial, length_unit: float, remedy: str) -> Material:
    """The material of a file, if it can be that of a solid.

    Parameters
    ----------
    file
        Name of the mesh file, for messages.
    carried
        What it says of its material.
    length_unit
        Unit of its coordinates [m].
    remedy
        Where the user can give a material, as an imperative clause.

    Raises
    ------
    MeshError
        None that can be used.
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
    """`check_carried_material` with a note of the values, and a warning where they are unusual; `run` tells them."""
    material = check_carried_material(file, carried, length_unit, remedy)
    run.note(f"the material {carried.name} of {file} is used: {describe_material(material, length_unit)}")
    for value, check in ((material.young, YOUNGS_MODULUS), (material.density, MATERIAL_DENSITY)):
        if doubt := check.doubt(value, None):
            run.warn(f"the material {carried.name} of {file}: {doubt}")
    return material
