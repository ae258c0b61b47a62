"""``stickslip reduce``: CAD, mesh, Craig-Bampton model and linear response of one blade."""

import importlib.metadata
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import damped, rayleigh_damping
from fe.mesh import Mesh
from fe.mesh_io import write_mesh
from fe.modal import modes
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import forced_response
from hbsolve.peak import undamped_from_peak
from reduction.craig_bampton import craig_bampton
from reduction.rom import ReducedModel
from reduction.rom_error import rom_error
from reduction.rom_io import save_rom
from study.blade_case import BladeCase
from study.blade_model import MODEL_CODE, BladeModel, blade_model, boundary_rows, clamped, mesh_size
from study.case import load_case, located
from study.figure.frequency_response import frequency_response_figure
from study.output import replace_file
from study.parallel import Task, run_parallel
from study.run_context import RunContext
from study.solid_check import solid_check
from study.store import stage
from study.table1.chain import N_FREQUENCY, THICKNESS_DIRECTION, first_peak, unit_force

#: Frequencies of the drawn response: this many, over the first three modes.
N_POINT = 2000
N_DRAWN = 3
#: The code that the reduction depends on, beside this file.
CODE = (*MODEL_CODE, "reduction", "hbsolve", "study.table1.chain")


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction:
    """A reduced blade and how good it is.

    Parameters
    ----------
    mesh, rom
        The mesh, and the reduced model on it.
    frequency, rom_frequency, rom_error
        Lowest frequencies, full and reduced [Hz], and the estimated relative error of the latter [-].
    peak_natural
        First natural frequency from the peak of the harmonic-balance response, its damping shift taken out [Hz].
    """

    mesh: Mesh
    rom: ReducedModel
    frequency: Float[NDArray[np.float64], " m"]
    rom_frequency: Float[NDArray[np.float64], " m"]
    rom_error: Float[NDArray[np.float64], " m"]
    peak_natural: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduced:
    """What the command reports: sizes, frequencies and files."""

    n_dof: int
    n_reduced: int
    frequency: Float[NDArray[np.float64], " m"]
    rom_frequency: Float[NDArray[np.float64], " m"]
    rom_error: Float[NDArray[np.float64], " m"]
    peak_natural: float
    files: tuple[Path, ...]


@stage("reduced blade", rooms=CODE)
def reduced_blade(model: BladeModel, title: str) -> Reduction:
    """Mesh, clamp, damp and reduce a blade, and compare with the full model."""
    mesh, undamped, _ = clamped(model)
    full = modes(undamped, N_FREQUENCY)
    system = damped(undamped, rayleigh_damping(model.damping_ratio, float(full.frequency[0])))
    provenance = {"title": title, "stickslip": importlib.metadata.version("stickslip"), "model": repr(model)}
    rom = craig_bampton(system, boundary_rows(mesh, system), model.n_mode, provenance)
    reduced = rom.modes(N_FREQUENCY)
    peak = first_peak(rom, float(reduced.frequency[0]))
    return Reduction(
        mesh=mesh,
        rom=rom,
        frequency=full.frequency,
        rom_frequency=reduced.frequency,
        rom_error=rom_error(system, rom, N_FREQUENCY),
        peak_natural=undamped_from_peak(peak, model.damping_ratio) / (2 * pi),
    )


def run_reduce(path: Path, run: RunContext) -> Reduced:
    """Reduce the blade of a case file and write STEP, mesh, reduced model and response."""
    assert run.output is not None
    case = load_case(path, BladeCase)
    model = blade_model(case, element=case.mesh.element, through_thickness=case.mesh.elements_through_thickness)
    with located(case, "mesh"):
        run.store.run(mesh_size, model)
    tasks = [
        Task(stage=reduced_blade, inputs={"model": model, "title": case.title}, label="reduction", weight=2.0),
        Task(stage=solid_check, inputs={"inputs": model}, label="CAD solid"),
    ]
    found, solid = (outcome.value for outcome in run_parallel(tasks, run.store, run.progress, "mesh and reduction"))
    files = {name: run.output / f"{path.stem}{name}" for name in (".step", ".vtu", "_rom.h5", "_response.png")}
    replace_file(files[".step"], solid.step)
    write_mesh(found.mesh, files[".vtu"])
    save_rom(found.rom, files["_rom.h5"])
    replace_file(files["_response.png"], _response_figure(found, case.title))
    return Reduced(
        n_dof=len(found.rom.free),
        n_reduced=found.rom.n_dof,
        frequency=found.frequency,
        rom_frequency=found.rom_frequency,
        rom_error=found.rom_error,
        peak_natural=found.peak_natural,
        files=tuple(files.values()),
    )


def _response_figure(found: Reduction, title: str) -> bytes:
    """Receptance of the tip for a force at the excitation point, over the first modes."""
    frequency = np.linspace(0.2 * found.rom_frequency[0], 1.15 * found.rom_frequency[N_DRAWN - 1], N_POINT)
    # The peaks are narrower than the grid: its points are joined by the resonances themselves.
    frequency = np.union1d(frequency, found.rom_frequency[:N_DRAWN])
    branch = forced_response(DynamicStiffness.of(found.rom), unit_force(found.rom), 2 * pi * frequency)
    response = branch.coefficients[:, 1, found.rom.rows("response", THICKNESS_DIRECTION)[0]]
    return frequency_response_figure(frequency, response, title=f"{title}: tip displacement for a force near the root")
