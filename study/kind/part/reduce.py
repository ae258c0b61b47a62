"""``stickslip reduce`` of a user's own part, from a STEP or a mesh file: to what ``stickslip solve`` takes."""

import importlib.metadata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from casefile.table import at_key, load_case, located
from fe.element import HEX8
from fe.file.mesh_file import read_mesh, write_mesh
from fe.material import Material
from fe.mesh import Mesh
from fe.mesh_quality import cell_quality
from fe.mesher.tetrahedra import TetRule
from fe.mode_check import ModeCheck
from geometry.errors import MissingSoftware, SelectorError
from geometry.face_selector import FaceSelector
from geometry.step_io import check_complete
from pipeline.output import replace_file
from reduction.file.rom_hdf5 import save_rom
from reduction.memory_estimate import mesh_memory, refuse_beyond_memory, tetrahedra_memory
from study.kind.part.pictures import face_pictures
from study.kind.part.places import Places, check_names, places
from study.kind.part.reduce_report import face_lines, frequency_table, station_table
from study.kind.part.stages import (
    NamedFaces,
    PartReduction,
    checked_part,
    named_faces,
    part_matrices,
    reduced_part,
    solid_summary,
    step_mesh,
)
from study.kind.part.table import MeshCase, PartTables, StepCase, part_kind
from study.modes.files import picture_modes
from study.reduce.comparison import ComparedReduction
from study.run_context import RunContext

#: Until a run knows better: seconds of fTetWild for each cell, with about so many cells in the cube of their size; of
#: assembly and of reduction for each degree of freedom [s].
CELL_SECONDS, CELLS_PER_CUBE = 4e-3, 16.0
ASSEMBLY_SECONDS, REDUCTION_SECONDS = 3e-5, 2e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedPart:
    """What the command reports.

    Parameters
    ----------
    reduction
        The reduced model beside the full one.
    mesh
        The mesh.
    least_scaled_jacobian
        Of its cells [-].
    n_mode
        Modes that were asked for [-].
    check
        Of the fixed-interface modes; None if none was asked for.
    notes
        What was mended in the file, a clause each.
    faces
        Of the solid, by the names of the case; none for a mesh file.
    files
        Written ones.
    """

    reduction: ComparedReduction
    mesh: Mesh
    least_scaled_jacobian: float
    n_mode: int
    check: ModeCheck | None
    notes: tuple[str, ...]
    faces: Mapping[str, NamedFaces]
    files: tuple[Path, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Meshed:
    """A mesh, and of a STEP file what was mended in it and which of its faces were named."""

    mesh: Mesh
    notes: tuple[str, ...] = ()
    faces: Mapping[str, NamedFaces] = field(default_factory=dict)


def run_reduce_part(path: Path, run: RunContext, *, checked: bool = False) -> ReducedPart:
    """Mesh, assemble and reduce the part of a case file, and write mesh, reduced model, tables and pictures.

    With `checked`, its fixed-interface modes are checked too.

    Raises
    ------
    CaseError
        With the mistakes of the case: a file that cannot be used, faces that are not there, a mesh that does not
        follow its solid, places beside the part, supports that leave it loose, more than the machine's memory.
    """
    assert run.output is not None
    case = load_case(path, part_kind(path) or StepCase)
    with located(case, "material"):
        material = case.material.material()
    meshed = _step(case, path.parent, run) if isinstance(case, StepCase) else _file(case, path.parent, run)
    found = places(case, meshed.mesh)
    reduced, check = _reduced(case, material, found, run, checked)
    stem, compared = path.stem, reduced.compared
    files = {name: run.output / f"{stem}{name}" for name in (".vtu", "_rom.h5", "_frequencies.csv", "_stations.csv")}
    shapes = reduced.shapes
    modes = {f"mode {k + 1}: {f:.6g} Hz": shapes.displacement[k] for k, f in enumerate(shapes.frequency)}
    write_mesh(found.mesh, files[".vtu"], modes)
    save_rom(compared.rom, files["_rom.h5"])
    replace_file(files["_frequencies.csv"], frequency_table(compared))
    replace_file(files["_stations.csv"], station_table(found.lines))
    drawn = _drawn(case, meshed.mesh, stem, found, reduced, run)
    return ReducedPart(
        reduction=compared,
        mesh=found.mesh,
        least_scaled_jacobian=float(cell_quality(found.mesh).scaled_jacobian.min()),
        n_mode=case.reduction.modes,
        check=check,
        notes=meshed.notes,
        faces=meshed.faces,
        files=(*files.values(), *drawn),
    )


def _step(case: StepCase, folder: Path, run: RunContext) -> _Meshed:
    """The tetrahedra of a STEP file."""
    file = folder / case.file
    with at_key(case, "file"):
        check_complete(file)
    selectors: dict[str, list[FaceSelector]] = {}
    for number, face in enumerate(case.face):
        with located(case, "face", number):
            selectors.setdefault(face.name, []).append(face.selector())
    check_names(case, frozenset(selectors), "the faces of this case are")
    with located(case, "mesh"):
        rule = TetRule(size=case.mesh.size, near=case.mesh.near)
    for name in rule.near:
        with at_key(case, "mesh", "near", name):
            replace(rule, near={name: rule.near[name]}).check_names(file.name, selectors)
    with at_key(case, "file"):
        solid = run.step("reading the solid").run(solid_summary, file)
    for note in solid.healing:
        run.note(f"{file}: {note}")
    with _at_selector(case):
        faces = run.store.run(named_faces, file, selectors)
    for line in face_lines(faces):  # before the mesher takes its minutes
        run.note(line)
    n_boundary = 3 * (len(case.point) + sum(line.stations for line in case.line))
    with at_key(case, "mesh", "size"):
        needed = tetrahedra_memory(
            solid.volume, solid.longest, rule.size, n_boundary, case.reduction.modes, is_compact=not case.line
        )
        refuse_beyond_memory(needed, f"a part of {solid.volume * 1e6:.3g} cm^3 in cells of {rule.size * 1e3:g} mm")
    seconds = CELL_SECONDS * CELLS_PER_CUBE * solid.volume / rule.size**3
    with located(case, "mesh"):
        mesh = run.step("tetrahedra", expected=seconds).run(step_mesh, file, selectors, rule)
    return _Meshed(mesh=mesh, notes=solid.healing, faces=faces)


@contextmanager
def _at_selector(case: StepCase) -> Iterator[None]:
    """Tell a selector that does not do where it stands; several tables may be of one name."""
    try:
        yield
    except SelectorError as error:
        tables = [number for number, face in enumerate(case.face) if face.name == error.region]
        with at_key(case, "face", tables[error.number]):
            raise


def _file(case: MeshCase, folder: Path, run: RunContext) -> _Meshed:
    """The mesh of a file."""
    with at_key(case, "file"):
        mesh = read_mesh(folder / case.file, case.length_unit)
    if HEX8.cell_type in mesh.cells:
        run.warn(f"{case.file} has hexahedra of 8 nodes, which are too stiff in bending: prefer those of 20 nodes")
    check_names(case, frozenset({*mesh.node_sets, *mesh.face_sets}), f"the sets of {case.file} are")
    return _Meshed(mesh=mesh)


def _reduced(
    case: PartTables, material: Material, found: Places, run: RunContext, checked: bool
) -> tuple[PartReduction, ModeCheck | None]:
    mesh, n_mode = found.mesh, case.reduction.modes
    n_boundary = sum(len(kept.nodes) * len(kept.directions) for kept in found.boundary.values())
    n_dof = 3 * mesh.n_node
    kept = (*found.boundary.values(), *found.supports)
    is_compact = found.to_nodes is None and all(len(each.directions) == 3 for each in kept)
    with located(case):
        needed = mesh_memory(mesh, n_boundary, n_mode, is_compact=is_compact)
        refuse_beyond_memory(needed, f"reducing a mesh of {n_dof} degrees of freedom to {n_boundary}")
    with located(case):
        matrices = run.step("matrices", expected=ASSEMBLY_SECONDS * n_dof).run(part_matrices, mesh, material)
        reduced = run.step("reduction", expected=REDUCTION_SECONDS * n_dof).run(
            reduced_part,
            mesh=mesh,
            material=material,
            matrices=matrices,
            to_nodes=found.to_nodes,
            supports=found.supports,
            boundary=found.boundary,
            n_mode=n_mode,
            damping_ratio=None if case.damping is None else case.damping.ratio,
            provenance={
                "title": case.title,
                "stickslip": importlib.metadata.version("stickslip"),
                "file": case.file,
                "material": repr(material),
            },
        )
        if not checked:
            return reduced, None
        rom = reduced.compared.rom
        step = run.step("check of the modes", expected=REDUCTION_SECONDS * n_dof / 2)
        return reduced, step.run(checked_part, mesh, matrices, found.to_nodes, found.supports, rom)


def _drawn(
    case: PartTables, mesh: Mesh, stem: str, found: Places, reduced: PartReduction, run: RunContext
) -> list[Path]:
    """Write the pictures; a machine that cannot draw has all the rest."""
    assert run.output is not None
    used = [name for support in case.support for name in support.on]
    used += [name for entry in (*case.line, *case.point, *case.boundary) for name in _on(entry)]
    if isinstance(case, StepCase):
        used += [face.name for face in case.face]
    points = {point.name: found.lines[point.name].stations for point in case.point}
    lines = [line.stations for name, line in found.lines.items() if name not in points]
    stations = np.concatenate([np.zeros((0, 3)), *lines])
    files = []
    try:
        names = list(dict.fromkeys(used))
        faces = {name: mesh.face_sets[name] for name in names if name in mesh.face_sets}
        sets = {name: mesh.node_sets[name] for name in names if name in mesh.node_sets and name not in faces}
        nodes = {name: mesh.points[found] for name, found in sets.items()} | points
        pictures = run.step("pictures of the mesh").run(face_pictures, mesh, faces, stations, case.title, nodes)
        for name, content in pictures.items():
            files.append(run.output / f"{stem}_{name}")
            replace_file(files[-1], content.tobytes())
        files += [file for file, _ in picture_modes(reduced.shapes, stem, run)]
    except MissingSoftware as error:
        run.warn(f"there are no pictures: {error}")
    return files


def _on(entry: object) -> list[str]:
    on, edge = getattr(entry, "on", None), getattr(entry, "edge", None)
    return [name for name in (on, *(edge or ())) if name is not None]
