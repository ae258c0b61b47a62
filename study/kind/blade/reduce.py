"""``stickslip reduce`` and ``modes`` of a blade: CAD, mesh, Craig-Bampton model, linear response; mode shapes."""

import importlib.metadata
from math import pi

import numpy as np

from casefile.table import located
from correlation.model import Sensor
from fe.assembly import assemble_compact
from fe.file.mesh_file import write_mesh
from fe.modal import modes
from fe.mode_check import ModeCheck
from figure.frequency_response import ReceptanceCurve
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import forced_response
from pipeline.output import replace_file
from pipeline.parallel import Task, run_parallel
from pipeline.store import stage
from reduction.base_excitation import BaseMotion
from reduction.file.rom_hdf5 import save_rom
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.case.structure import Structure, make_mesh_base_motion, make_reduced_structure
from study.case.surface import make_surface
from study.kind.blade.model import (
    THICKNESS_DIRECTION,
    BladeModel,
    Reduction,
    clamped,
    count_mesh_dofs,
    make_blade_model,
    make_unit_force,
    reduce_blade,
    solid_check,
)
from study.kind.blade.table import BladeStructureTable
from study.kind.registry import OpenCase
from study.modes.files import MODE_SECONDS, write_shapes
from study.modes.shapes import Shapes, make_shapes
from study.reduce.report import report_reduction
from study.run_context import Answer, RunContext

#: Number of frequencies of the drawn response, and number of modes in their range.
N_POINT = 2000
N_DRAWN = 3
#: Names of places in a case, by retained node set.
PLACES = {"response": "tip", "excitation": "excitation"}


@stage("reduced blade")
def reduced_blade(model: BladeModel, title: str) -> Reduction:
    """Reduce a blade and store its provenance."""
    provenance = {"title": title, "stickslip": importlib.metadata.version("stickslip"), "model": repr(model)}
    return reduce_blade(model, provenance)


@stage("check of a reduced blade")
def checked_blade(model: BladeModel, rom: ReducedModel) -> ModeCheck:
    """Check the fixed-interface modes of a blade's reduced model."""
    return check_fixed_interface_modes(clamped(model)[1], rom)


def reduce_blade_case(opened: OpenCase, run: RunContext, checked: bool = False) -> Answer:
    """Reduce the blade of a case and write STEP, mesh, reduced model and response.

    With `checked`, the fixed-interface modes are checked too.
    """
    assert run.output is not None
    model, title, stem = model_of_case(opened, run), opened.title, opened.path.stem
    tasks = [_make_reduction_task(model, title), Task(stage=solid_check, inputs={"inputs": model}, label="CAD solid")]
    result, solid = (outcome.value for outcome in run_parallel(tasks, run.store, run.progress, "mesh and reduction"))
    check = run.step("check of the modes").run(checked_blade, model, result.rom) if checked else None
    files = {name: run.output / f"{stem}{name}" for name in (".step", ".vtu", "_rom.h5")}
    replace_file(files[".step"], solid.step)
    write_mesh(result.mesh, files[".vtu"])
    save_rom(result.rom, files["_rom.h5"])
    drawn = run.draw({f"{stem}_response": _compute_tip_response(result, title)})
    return report_reduction(
        result,
        model.n_mode,
        check,
        [*files.values(), *drawn],
        notes=["", f"  first, from the peak of the harmonic-balance response: {result.peak_natural:.5f} Hz"],
        facts={"hb_peak_hz": result.peak_natural},
    )


def make_blade_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Make the reduced blade of a case, with the places of its mesh and a force of 1 N at the excitation point."""
    model = model_of_case(opened, run)
    (outcome,) = run_parallel([_make_reduction_task(model, opened.title)], run.store, run.progress, "reduction")
    result: Reduction = outcome.value
    places = {}
    for name, place in PLACES.items():
        if name in result.rom.boundary_sets:
            places[place] = np.zeros(result.rom.n_dof)
            places[place][result.rom.rows(name, THICKNESS_DIRECTION)] = 1.0

    def base(axis: str) -> BaseMotion:
        mass, _ = assemble_compact(result.mesh, model.material)
        return make_mesh_base_motion(result.rom, mass, axis)

    return make_reduced_structure(
        result.rom,
        result.mesh.points,
        base=base,
        surfaces=lambda: {"blade": make_surface(result.mesh, result.rom)},
        loss_factor=opened.case.structure.damping.loss_factor,
        places=places,
        harmonic_force=make_unit_force(result.rom).coefficients,
        sensors=(Sensor(name="tip", row=places["tip"]),),
    )


def model_of_case(opened: OpenCase, run: RunContext) -> BladeModel:
    """Make the blade model of a case, and check it by meshing."""
    table: BladeStructureTable = opened.case.structure
    mesh = table.mesh
    model = make_blade_model(
        opened.case, table, "structure", element=mesh.element, through_thickness=mesh.elements_through_thickness
    )
    with located(opened.case, "structure", "mesh"):
        run.store.run(count_mesh_dofs, model)
    return model


def _make_reduction_task(model: BladeModel, title: str) -> Task:
    return Task(stage=reduced_blade, inputs={"model": model, "title": title}, label="reduction", weight=2.0)


def _compute_tip_response(result: Reduction, title: str) -> ReceptanceCurve:
    """Compute the receptance of the tip for a force at the excitation point, over the first modes."""
    frequency = np.linspace(0.2 * result.rom_frequency[0], 1.15 * result.rom_frequency[N_DRAWN - 1], N_POINT)
    # The resonance frequencies are added, because the peaks are narrower than the grid.
    frequency = np.union1d(frequency, result.rom_frequency[:N_DRAWN])
    branch = forced_response(DynamicStiffness.of(result.rom), make_unit_force(result.rom), 2 * pi * frequency)
    response = branch.coefficients[:, 1, result.rom.rows("response", THICKNESS_DIRECTION)[0]]
    title = f"{title}: tip displacement for a force near the root"
    return ReceptanceCurve(frequency=frequency, receptance=response, title=title)


@stage("mode shapes of a blade")
def compute_blade_shapes(model: BladeModel, n_mode: int) -> Shapes:
    """Compute the lowest modes of a clamped blade."""
    mesh, system, _ = clamped(model)
    return make_shapes(mesh, model.material, system, modes(system, n_mode))


def draw_blade_modes(opened: OpenCase, run: RunContext, n_mode: int, film_of: int | None) -> Answer:
    """Compute and draw the lowest modes of a case."""
    model = model_of_case(opened, run)
    n_dof = run.store.run(count_mesh_dofs, model)
    shapes = run.step("modes", expected=MODE_SECONDS * n_dof / 1e4).run(compute_blade_shapes, model, n_mode)
    return write_shapes(shapes, opened.path.stem, film_of, run)
