"""``stickslip reduce`` of a rig: CAD, meshes, reduced assembly, and first modes with all contacts stuck."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.table import located
from fe.dense_modes import compute_dense_modes
from fe.file.mesh_file import write_mesh
from fe.mesher.body import join_meshes
from fe.mode_check import ModeCheck
from geometry.errors import GeometryError, MissingSoftware
from geometry.interference import check_no_overlap
from geometry.rig import Rig, rig_parts
from geometry.step_io import write_assembly_step
from geometry.system_library import require_system_libraries
from pipeline.output import replace_file
from pipeline.parallel import Task, run_parallel
from pipeline.store import stage
from reduction.assembly import ReducedAssembly
from reduction.available_memory import read_available_memory
from reduction.file.rom_hdf5 import save_assembly
from reduction.joined_bodies import LinePair, join_bodies
from reduction.line_contact import Tangents
from study.case.tables import Case
from study.kind.registry import OpenCase
from study.kind.rig.contact import list_dead_weights, make_line_pairs
from study.kind.rig.model import RigModel, mesh_in_tetrahedra
from study.kind.rig.pictures import rig_pictures, stuck_mode_pictures
from study.kind.rig.reduction import RigReduction, check_bodies, index_by_body, list_reduction_tasks, make_rig_reduction
from study.kind.rig.table import RigTable, make_rig_model
from study.modes.files import write_contents
from study.reduce.report import describe_check, document_check, report_fewer_rig_modes
from study.run_context import Answer, RunContext

#: Number of reported modes of the blade without contacts and of the stuck rig, and of drawn modes of the stuck rig.
N_BLADE, N_STUCK, N_DRAWN = 3, 6, 3
#: Work of the CAD solids, in the work of reducing a thousand nodes.
SOLID_WORK = 3.0


def reduce_rig_case(opened: OpenCase, run: RunContext, checked: bool = False) -> Answer:
    """Reduce the rig of a case and write STEP, mesh with modes, reduced assembly and pictures.

    With `checked`, the fixed-interface modes of its bodies are checked too.

    Raises
    ------
    CaseError
        If the case has mistakes: bodies that cannot be built, do not mate or overlap, or bad meshes.
    """
    assert run.output is not None
    case, stem, title = opened.case, opened.path.stem, opened.title
    model = make_rig_model(case)
    pairs = make_line_pairs(case, model.rig)
    list_dead_weights(case)  # checked here, so that no later command refuses a rig that was reduced
    with located(case, "structure", "mesh"):
        model = mesh_in_tetrahedra(model, run.store, run.progress)
        step, result, check = _compute_reduction(case, model, run, checked)
    assembly = result.assembly
    frequency, shapes = stuck_modes(assembly, pairs, case.structure.contact.sliding)
    displacement = assembly.on_whole_mesh(shapes[:, :N_DRAWN])
    files = {name: run.output / f"{stem}{name}" for name in (".step", ".vtu", "_rom.h5")}
    replace_file(files[".step"], step)
    named = {
        f"stuck mode {k + 1}: {f:.6g} Hz": u for k, (f, u) in enumerate(zip(frequency, displacement, strict=False))
    }
    write_mesh(join_meshes(result.meshes), files[".vtu"], named)
    save_assembly(_set_title(assembly, title), files["_rom.h5"])
    pictures = _draw_pictures(stem, title, model, frequency[:N_DRAWN], displacement, run)
    bodies = {
        body: {
            "n_dof": len(rom.free),
            "n_boundary": rom.n_boundary,
            "n_mode": rom.n_dof - rom.n_boundary,
            "least_scaled_jacobian": result.least_scaled_jacobian[body],
        }
        for body, rom in assembly.bodies.items()
    }
    document = {
        "bodies": bodies,
        "n_dof": result.n_dof,
        "n_reduced": assembly.n_dof,
        "blade_frequency_hz": list(map(float, assembly.bodies["blade"].modes(N_BLADE).frequency)),
        "stuck_frequency_hz": list(map(float, frequency[:N_STUCK])),
        "energy_share": {
            k: list(map(float, v)) for k, v in compute_energy_share(assembly, shapes[:, :N_STUCK]).items()
        },
        **({"mode_check": {body: document_check(item) for body, item in check.items()}} if check else {}),
        "files": [str(file) for file in (*files.values(), *pictures)],
    }
    notes = report_fewer_rig_modes(assembly, model.n_mode)
    checks = [f"  {body}: {describe_check(item)}" for body, item in check.items()]
    return Answer(document=document, text=_format_document(document, notes, checks))


def _format_document(document: dict[str, Any], notes: list[str], checks: list[str]) -> str:
    """Format the document as tables, with notes and results of the checks."""
    bodies, shares = document["bodies"], document["energy_share"]
    total = {name: sum(body[name] for body in bodies.values()) for name in ("n_dof", "n_boundary", "n_mode")}
    worst = min(body["least_scaled_jacobian"] for body in bodies.values())
    rows = {**bodies, "all": {**total, "least_scaled_jacobian": worst}}
    stuck = zip(document["stuck_frequency_hz"], *shares.values(), strict=True)
    if checks:
        checks = ["  checked, of each body more modes than are stored:", *checks, ""]
    return "\n".join(
        [
            f"{document['n_dof']} degrees of freedom reduced to {document['n_reduced']}",
            *notes,
            "",
            "  body              full  boundary  modes   least scaled Jacobian",
            *(
                f"  {body:15} {row['n_dof']:6} {row['n_boundary']:9} {row['n_mode']:6} "
                f"{row['least_scaled_jacobian']:23.2f}"
                for body, row in rows.items()
            ),
            "",
            *checks,
            f"  blade without contacts: {', '.join(f'{f:.2f}' for f in document['blade_frequency_hz'])} Hz",
            "",
            "  all contacts stuck                 kinetic energy in",
            f"  mode     frequency {''.join(f'{kind:>12}' for kind in shares)}",
            *(
                f"  {number:4} {frequency:10.2f} Hz {''.join(f'{100 * share:10.1f} %' for share in own)}"
                for number, (frequency, *own) in enumerate(stuck, start=1)
            ),
            "",
            *document["files"],
        ]
    )


def stuck_modes(
    assembly: ReducedAssembly, pairs: Sequence[LinePair], tangents: Tangents
) -> tuple[Float[NDArray[np.float64], " r"], Float[NDArray[np.float64], "r r"]]:
    """Compute the modes with all contacts closed and stuck: frequencies [Hz], mass-normalised shapes [kg^-1/2]."""
    modes = compute_dense_modes(assembly.mass, join_bodies(assembly, pairs, tangents=tangents).stuck)
    return modes.frequency, modes.mode_shapes


def compute_energy_share(
    assembly: ReducedAssembly, shapes: Float[NDArray[np.float64], "r m"]
) -> dict[str, Float[NDArray[np.float64], " m"]]:
    """Compute the fractions of the kinetic energy of mass-normalised shapes, by kind of body; their sum is 1."""
    result: dict[str, Float[NDArray[np.float64], " m"]] = {}
    for body, rom in assembly.bodies.items():
        own, kind = shapes[assembly.columns(body)], body.partition("_")[0]
        result[kind] = result.get(kind, np.zeros(shapes.shape[1])) + np.einsum("rm,rm->m", own, rom.mass @ own)
    return result


def _compute_reduction(
    case: Case[RigTable], model: RigModel, run: RunContext, checked: bool
) -> tuple[str, RigReduction, dict[str, ModeCheck]]:
    """Compute the text of the STEP file, the reduction, and with `checked` the checks of the bodies."""
    meshed = model.meshed()
    reductions = list_reduction_tasks(model, meshed)
    solid = Task(stage=rig_solid, inputs={"rig": model.rig}, label="CAD solids", weight=SOLID_WORK)
    try:
        *bodies, step = run_parallel(
            [*reductions, solid], run.store, run.progress, "meshes and reduction", memory=read_available_memory()
        )
    except GeometryError as error:
        # The cause is in the dimensions, which are in several tables, and not in the mesh.
        with located(case, "structure"):
            raise error
    check = check_bodies(model, index_by_body(reductions, bodies), run.store, run.progress) if checked else {}
    return str(step.value), make_rig_reduction(model, meshed, reductions, bodies), check


def _set_title(assembly: ReducedAssembly, title: str) -> ReducedAssembly:
    titled = {
        body: replace(rom, provenance={"title": title, **rom.provenance}) for body, rom in assembly.bodies.items()
    }
    return ReducedAssembly(bodies=titled)


def _draw_pictures(
    stem: str,
    title: str,
    model: RigModel,
    frequency: Float[NDArray[np.float64], " m"],
    displacement: Float[NDArray[np.float64], "m node 3"],
    run: RunContext,
) -> list[Path]:
    """Write the pictures; on a machine that cannot draw, only warn."""
    bodies: dict[str, NDArray[np.uint8]] = {}
    modes: dict[str, NDArray[np.uint8]] = {}
    try:
        bodies = run.step("pictures of the rig").run(rig_pictures, model, title)
        step = run.step("pictures of stuck modes")
        modes = step.run(stuck_mode_pictures, model, frequency, displacement, step.report)
    except MissingSoftware as error:
        run.warn(f"there are no pictures{' of modes' if bodies else ''}: {error}")
    return write_contents(run, stem, {**bodies, **modes})


@stage("CAD solids of a rig")
def rig_solid(rig: Rig) -> str:
    """Build the five solids, refuse overlapping ones, and return the text of their STEP file."""
    require_system_libraries("cad")
    parts = rig_parts(rig)
    check_no_overlap(parts)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
        file = Path(folder) / "rig.step"
        write_assembly_step("rig", parts, file)
        return file.read_text(encoding="utf-8")
