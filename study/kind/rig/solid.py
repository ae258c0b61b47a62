"""The rig in CAD, as a stage: its STEP file, once no two bodies overlap."""

import tempfile
from pathlib import Path

from geometry.interference import check_no_overlap
from geometry.rig import Rig, rig_parts
from geometry.step_io import write_assembly_step
from geometry.system_library import preflight
from pipeline.store import stage


@stage("CAD solids of a rig")
def rig_solid(rig: Rig) -> str:
    """Build the five solids, refuse those that overlap, and return the text of their STEP file."""
    preflight("cad")
    parts = rig_parts(rig)
    check_no_overlap(parts)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
        file = Path(folder) / "rig.step"
        write_assembly_step("rig", parts, file)
        return file.read_text(encoding="utf-8")
