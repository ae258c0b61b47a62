"""The material that a mesh file carries, used with a note of its values if they can be those of a solid."""

from casefile.plausibility import MATERIAL_DENSITY, YOUNGS_MODULUS
from fe.errors import MeshError
from fe.file.file_material import CarriedMaterial, describe_material
from fe.material import Material
from study.run_context import RunContext


def use_carried_material(
    file: str, carried: CarriedMaterial, length_unit: float, remedy: str, run: RunContext
) -> Material:
    """The material of a file, with a note, and a warning where it is unusual.

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
    run
        Tells.

    Raises
    ------
    MeshError
        None that can be used.
    """
    if carried.material is None:
        why = f"{carried.obstacle}: " if carried.obstacle else f"{file} carries no material: "
        raise MeshError(why + remedy)
    material, told = carried.material, describe_material(carried.material, length_unit)
    values = ((material.young, YOUNGS_MODULUS), (material.density, MATERIAL_DENSITY))
    refusals = [words for value, check in values if (words := check.refusal(value, None))]
    if refusals:
        raise MeshError(
            f"the material {carried.name} of {file} is {told}: {refusals[0]}; if the file has other units, {remedy}"
        )
    run.note(f"the material {carried.name} of {file} is used: {told}")
    for value, check in values:
        if doubt := check.doubt(value, None):
            run.warn(f"the material {carried.name} of {file}: {doubt}")
    return material
