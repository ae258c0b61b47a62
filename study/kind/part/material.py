"""The material of a part: from the case, or from its mesh file."""

from pathlib import Path

from casefile.table import at_key, located
from fe.file.file_material import CarriedMaterial, describe_material, list_differences, read_file_material
from fe.file.mesh_file import require_mesh_file
from fe.material import Material
from study.carried_material import use_carried_material
from study.case.tables import Case
from study.kind.part.table import PartTable
from study.run_context import RunContext

REMEDY = "add [structure.material], with young, poisson and density"


def find_part_material(case: Case[PartTable], folder: Path, run: RunContext) -> Material:
    """Find the material of a part in its case or its mesh file; warn if the two differ.

    Parameters
    ----------
    case
        Case of a part.
    folder
        Folder of the mesh file.
    run
        Run that prints the used material and the warning.

    Raises
    ------
    CaseError
        Invalid values of the material, or no material in either.
    """
    table = case.structure
    carried = CarriedMaterial()
    if table.length_unit is not None:
        with at_key(case, "structure", "file"):
            require_mesh_file(folder / table.file)  # otherwise a missing file would be reported as one without material
            carried = read_file_material(folder / table.file, table.length_unit)
    if table.material is None:
        assert table.length_unit is not None
        with located(case, "structure"):
            return use_carried_material(table.file, carried, table.length_unit, REMEDY, run)
    with located(case, "structure", "material"):
        material = table.material.material()
    if carried.material is not None and (names := list_differences(material, carried.material)):
        assert table.length_unit is not None
        content = describe_material(carried.material, table.length_unit)
        run.warn(
            f"{table.file} contains the material {carried.name}, {content}, whose {' and '.join(names)} differs from "
            "[structure.material]: the values of the case are used; remove the table to use those of the file"
        )
    return material
