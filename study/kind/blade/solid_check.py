"""The CAD solid behind the mesh: its STEP file, and its volume against the mesh's."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from fe.element import ELEMENTS, HEX20
from fe.solid import jacobian
from geometry.blade import Blade
from geometry.blade_solid import blade_part
from geometry.plain_blade import plain_blade_part
from geometry.step_io import write_step
from geometry.system_library import preflight
from pipeline.store import stage
from study.kind.blade.model import BladeModel
from study.kind.blade.table import mesh_any

#: The mesh that is compared: quadratic, since straight faces would lose what a curved groove holds.
THROUGH_THICKNESS = 2


@dataclass(frozen=True, kw_only=True)
class SolidCheck:
    """A blade as CAD and as mesh.

    Parameters
    ----------
    cad_volume, mesh_volume
        [m^3].
    step
        The STEP file.
    """

    cad_volume: float
    mesh_volume: float
    step: str


@stage("CAD solid")
def solid_check(inputs: BladeModel) -> SolidCheck:
    """Build the solid, write it as STEP and compare volumes."""
    preflight("cad")
    part = blade_part(inputs.blade) if isinstance(inputs.blade, Blade) else plain_blade_part(inputs.blade)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "blade.step"
        write_step(part, file)
        step = file.read_text(encoding="utf-8")
    quadratic = replace(inputs, element=HEX20.name, through_thickness=THROUGH_THICKNESS)
    mesh = mesh_any(inputs.blade, quadratic.rule, inputs.pads)
    volume = 0.0
    for cell_type, nodes in mesh.cells.items():
        at, weights = ELEMENTS[cell_type].rule
        volume += float((jacobian(ELEMENTS[cell_type], mesh.points[nodes], at)[0] @ weights).sum())
    return SolidCheck(cad_volume=part.volume, mesh_volume=volume, step=step)
