"""The material of a part: that of the case, or that which its mesh file carries."""

from pathlib import Path

from casefile.plausibility import MATERIAL_DENSITY, YOUNGS_MODULUS
from casefile.table import at_key, located
from fe.errors import MeshError
from fe.file.file_material import CarriedMaterial, describe_material, list_differences, read_file_material
from fe.material import Material
from study.case.tables import Case
from study.kind.part.table import PartTable
from study.run_context import RunContext


def find_part_material(case: Case[PartTable], folder: Path, run: RunContext) -> Material:
    """The material of a case, beside that of its mesh file.

    Parameters
    ----------
    case
        Case of a part.
    folder
        Folder of the mesh file.
    run
        Tells which material is used, and where the two differ.

    Raises
    ------
    CaseError
        Values that make no material, or no material in either.
    """
    table = case.structure
    carried = CarriedMaterial()
    if table.length_unit is not None:
        with at_key(case, "structure", "file"):
            carried = read_file_material(folder / table.file, table.length_unit)
    if table.material is None:
        assert table.length_unit is not None
        with located(case, "structure"):
            return _use(table.file, carried, table.length_unit, run)
    with located(case, "structure", "material"):
        material = table.material.material()
    if carried.material is not None and (names := list_differences(material, carried.material)):
        assert table.length_unit is not None
        told = describe_material(carried.material, table.length_unit)
        run.warn(
            f"{table.file} carries the material {carried.name}, {told}, whose {' and '.join(names)} is not that of "
            "[structure.material]: the case is used; remove the table to use the file's"
        )
    return material


def _use(file: str, carried: CarriedMaterial, length_unit: float, run: RunContext) -> Material:
    if carried.material is None:
        why = f"{carried.obstacle}: " if carried.obstacle else f"{file} carries no material: "
        raise MeshError(f"{why}add [structure.material], with young, poisson and density")
    material, told = carried.material, describe_material(carried.material, length_unit)
    values = ((material.young, YOUNGS_MODULUS), (material.density, MATERIAL_DENSITY))
    refusals = [words for value, check in values if (words := check.refusal(value, None))]
    if refusals:
        raise MeshError(
            f"the material {carried.name} of {file} is {told}: {refusals[0]}; if the file has other units, add "
            "[structure.material]"
        )
    run.note(f"the material {carried.name} of {file} is used: {told}")
    for value, check in values:
        if doubt := check.doubt(value, None):
            run.warn(f"the material {carried.name} of {file}: {doubt}")
    return material
