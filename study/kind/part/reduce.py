"""``stickslip reduce`` of a user's part, from a STEP or a mesh file, to the reduced model for ``stickslip solve``."""

import importlib.metadata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.table import at_key, located
from fe.file.mesh_file import read_mesh, write_mesh
from fe.material import Material
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.tetrahedra import TetRule
from fe.sparse.factor import Symmetric
from geometry.errors import MissingSoftware, SelectorError
from geometry.face_selector import FaceSelector
from geometry.part import MILLIMETRES_PER_METRE
from geometry.step_io import check_complete
from pipeline.output import replace_file
from reduction.base_excitation import BaseMotion
from reduction.errors import JointError
from reduction.file.rom_hdf5 import save_rom
from reduction.memory_estimate import estimate_mesh_memory, estimate_tetrahedra_memory, refuse_beyond_memory
from reduction.rom import ReducedModel
from study.case.model_doubt import warn_of_linear_cells, warn_of_seams, warn_of_size
from study.case.structure import Structure, make_mesh_base_motion, make_reduced_structure
from study.case.surface import make_surface
from study.case.tables import Case
from study.kind.part.material import find_part_material
from study.kind.part.places import Places, check_names, find_places
from study.kind.part.reduce_report import (
    document_faces,
    format_face_lines,
    format_frequency_table,
    format_station_table,
)
from study.kind.part.stages import (
    NamedFaces,
    PartReduction,
    checked_part,
    face_pictures,
    named_faces,
    part_matrices,
    reduced_part,
    solid_summary,
    step_mesh,
)
from study.kind.part.table import PartTable
from study.kind.registry import OpenCase
from study.modes.files import picture_modes, write_contents
from study.reduce.report import report_reduction
from study.run_context import Answer, RunContext

#: Estimated durations until a run has measured them: meshing by fTetWild per cell [s] and cells per cube of the cell
#: size [-]; assembly and reduction per degree of freedom [s].
CELL_SECONDS, CELLS_PER_CUBE = 4e-3, 16.0
ASSEMBLY_SECONDS, REDUCTION_SECONDS = 3e-5, 2e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshedPart:
    """The mesh of a part; for a STEP file with notes of repairs and with the named faces."""

    mesh: Mesh
    notes: tuple[str, ...] = ()
    faces: Mapping[str, NamedFaces] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class PartModel:
    """A part, meshed and reduced.

    Parameters
    ----------
    meshed
        Mesh of the part.
    places
        Supports, points, lines and sets of the case on the mesh.
    matrices
        Mass and stiffness of all nodes.
    reduced
        Reduced model and its first modes.
    """

    meshed: MeshedPart
    places: Places
    matrices: tuple[Symmetric, Symmetric]
    reduced: PartReduction


def reduce_part(opened: OpenCase, run: RunContext) -> PartModel:
    """Mesh, assemble and reduce the part of a case.

    Raises
    ------
    CaseError
        If the case has mistakes: a file that cannot be used, missing faces, a mesh that differs from its solid, places
        off the part, supports that leave rigid motions, or a model that exceeds the machine's memory.
    """
    case: Case[PartTable] = opened.case
    material = find_part_material(case, opened.folder, run)
    meshed = _step(case, opened.folder, run) if case.structure.is_step else _read_file(case, opened.folder)
    result = find_places(case, meshed.mesh)
    matrices, reduced = _reduce(case, opened.title, material, result, run)
    return PartModel(meshed=meshed, places=result, matrices=matrices, reduced=reduced)


def make_part_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Make the structure of a reduced part; normals and tangents of its contact lines are stored rows."""
    model = reduce_part(opened, run)
    rom, lines = model.reduced.compared.rom, model.places.lines
    stored = {}
    for name, line in lines.items():
        if not line.tangents.any():
            continue  # a point
        along, across = np.moveaxis(line.tangents, 1, 0)
        for word, directions in (("normal", line.normal), ("along", along), ("across", across)):
            stored[f"{name} {word}"] = make_rows_along(rom, name, directions)
    stations = {name: line.stations for name, line in lines.items()}
    damping = opened.case.structure.damping

    def base(axis: str) -> BaseMotion:
        if not model.places.supports:
            raise JointError(f'base = "{axis}": no [[structure.support]] fixes the part to a base that could move')
        return make_mesh_base_motion(rom, model.matrices[0], axis)

    return make_reduced_structure(
        rom,
        model.places.mesh.points,
        stations,
        stored=stored,
        base=base,
        surfaces=lambda: {"part": make_surface(model.places.mesh, rom)},
        loss_factor=0.0 if damping is None else damping.loss_factor,
    )


def make_rows_along(
    rom: ReducedModel, name: str, directions: Float[NDArray[np.float64], "station 3"]
) -> Float[NDArray[np.float64], "station r"]:
    """Make the row of the displacement of each station of a boundary set along the direction of that station."""
    result = np.zeros((len(directions), rom.n_dof))
    for axis in range(3):
        result[np.arange(len(directions)), rom.rows(name, axis)] = directions[:, axis]
    return result


def reduce_part_case(opened: OpenCase, run: RunContext, checked: bool = False) -> Answer:
    """Reduce the part of a case, and write mesh, reduced model, tables and pictures.

    With `checked`, the fixed-interface modes are checked too.

    Raises
    ------
    CaseError
        See `reduce_part`.
    """
    assert run.output is not None
    case, stem = opened.case, opened.path.stem
    model = reduce_part(opened, run)
    meshed, result, check = model.meshed, model.places, None
    mesh, compared = result.mesh, model.reduced.compared
    if checked:
        with located(case, "structure"):
            step = run.step("check of the modes", expected=REDUCTION_SECONDS * 3 * mesh.n_node / 2)
            check = step.run(checked_part, mesh, model.matrices, result.to_nodes, result.supports, compared.rom)
    files = {name: run.output / f"{stem}{name}" for name in (".vtu", "_rom.h5", "_frequencies.csv", "_stations.csv")}
    write_mesh(mesh, files[".vtu"], model.reduced.shapes.fields)
    save_rom(compared.rom, files["_rom.h5"])
    replace_file(files["_frequencies.csv"], format_frequency_table(compared))
    replace_file(files["_stations.csv"], format_station_table(result.lines))
    drawn = _draw_pictures(opened, model, run)
    worst = float(measure_cell_quality(mesh).scaled_jacobian.min())
    faces = format_face_lines(meshed.faces)
    return report_reduction(
        compared,
        case.structure.reduction.modes,
        check,
        [*files.values(), *drawn],
        head=[*faces, *([""] if faces else []), f"{mesh.n_cell} elements, worst scaled Jacobian {worst:.2f}"],
        facts={
            "n_node": mesh.n_node,
            "n_element": mesh.n_cell,
            "least_scaled_jacobian": worst,
            "mended": list(meshed.notes),
            **({"faces": document_faces(meshed.faces)} if meshed.faces else {}),
            "boundary": {name: len(rows) for name, rows in compared.rom.boundary_sets.items()},
        },
    )


def _step(case: Case[PartTable], folder: Path, run: RunContext) -> MeshedPart:
    """Mesh a STEP file with tetrahedra."""
    table = case.structure
    assert table.mesh is not None
    file = folder / table.file
    with at_key(case, "structure", "file"):
        check_complete(file)
    selectors: dict[str, list[FaceSelector]] = {}
    for number, face in enumerate(case.structure.face):
        with located(case, "structure", "face", number):
            selectors.setdefault(face.name, []).append(face.selector())
    check_names(case, frozenset(selectors), "the faces of this case are")
    with located(case, "structure", "mesh"):
        rule = TetRule(size=table.mesh.size, near=table.mesh.near)
    for name in rule.near:
        with at_key(case, "structure", "mesh", "near", name):
            replace(rule, near={name: rule.near[name]}).check_names(file.name, selectors)
    with at_key(case, "structure", "file"):
        solid = run.step("reading the solid").run(solid_summary, file)
    warn_of_size(solid.longest, 1 / MILLIMETRES_PER_METRE)
    for note in solid.healing:
        run.note(f"{file}: {note}")
    with _at_selector(case):
        faces = run.store.run(named_faces, file, selectors)
    for line in format_face_lines(faces):  # printed before the mesher, which takes minutes
        run.note(line)
    n_boundary = 3 * (len(table.point) + sum(line.stations for line in table.line))
    with at_key(case, "structure", "mesh", "size"):
        needed = estimate_tetrahedra_memory(
            solid.volume,
            solid.longest,
            rule.size,
            n_boundary,
            case.structure.reduction.modes,
            is_compact=not table.line,
        )
        refuse_beyond_memory(needed, f"a part of {solid.volume * 1e6:.3g} cm^3 in cells of {rule.size * 1e3:g} mm")
    seconds = CELL_SECONDS * CELLS_PER_CUBE * solid.volume / rule.size**3
    with located(case, "structure", "mesh"):
        mesh = run.step("tetrahedra", expected=seconds).run(step_mesh, file, selectors, rule)
    return MeshedPart(mesh=mesh, notes=solid.healing, faces=faces)


@contextmanager
def _at_selector(case: Case[PartTable]) -> Iterator[None]:
    """Locate the error of a face selector at its table; several tables may have the same name."""
    try:
        yield
    except SelectorError as error:
        tables = [number for number, face in enumerate(case.structure.face) if face.name == error.region]
        with at_key(case, "structure", "face", tables[error.number]):
            raise


def _read_file(case: Case[PartTable], folder: Path) -> MeshedPart:
    """Read and check the mesh of a mesh file."""
    table = case.structure
    assert table.length_unit is not None
    with at_key(case, "structure", "file"):
        mesh = read_mesh(folder / table.file, table.length_unit)
    warn_of_size(float(np.ptp(mesh.points, axis=0).max()), table.length_unit)
    warn_of_linear_cells(mesh, table.file)
    if not case.joint and not any(place.other_at for line in case.line for place in line.normal):
        warn_of_seams(mesh, table.file)
    check_names(case, frozenset({*mesh.node_sets, *mesh.face_sets}), f"the sets of {table.file} are")
    return MeshedPart(mesh=mesh)


def _reduce(
    case: Case[PartTable], title: str, material: Material, result: Places, run: RunContext
) -> tuple[tuple[Symmetric, Symmetric], PartReduction]:
    table, mesh, n_mode = case.structure, result.mesh, case.structure.reduction.modes
    n_boundary = sum(len(retained.nodes) * len(retained.directions) for retained in result.boundary.values())
    n_dof = 3 * mesh.n_node
    retained = (*result.boundary.values(), *result.supports)
    is_compact = result.to_nodes is None and all(len(item.directions) == 3 for item in retained)
    with located(case, "structure"):
        needed = estimate_mesh_memory(mesh, n_boundary, n_mode, is_compact=is_compact)
        refuse_beyond_memory(needed, f"reducing a mesh of {n_dof} degrees of freedom to {n_boundary}")
    with located(case, "structure"):
        matrices = run.step("matrices", expected=ASSEMBLY_SECONDS * n_dof).run(part_matrices, mesh, material)
        reduced = run.step("reduction", expected=REDUCTION_SECONDS * n_dof).run(
            reduced_part,
            mesh=mesh,
            material=material,
            matrices=matrices,
            to_nodes=result.to_nodes,
            supports=result.supports,
            boundary=result.boundary,
            n_mode=n_mode,
            damping_ratio=None if table.damping is None else table.damping.viscous_ratio,
            provenance={
                "title": title,
                "stickslip": importlib.metadata.version("stickslip"),
                "file": table.file,
                "material": repr(material),
            },
        )
    return matrices, reduced


def _draw_pictures(opened: OpenCase, model: PartModel, run: RunContext) -> list[Path]:
    """Write the pictures; on a machine that cannot draw, only warn."""
    table, stem, mesh, result = opened.case.structure, opened.path.stem, model.meshed.mesh, model.places
    used = [name for support in table.support for name in support.on]
    used += [name for entry in (*table.line, *table.point, *table.boundary) for name in _list_faces(entry)]
    used += [face.name for face in table.face]
    points = {point.name: result.lines[point.name].stations for point in table.point}
    lines = [line.stations for name, line in result.lines.items() if name not in points]
    stations = np.concatenate([np.zeros((0, 3)), *lines])
    files: list[Path] = []
    try:
        names = list(dict.fromkeys(used))
        faces = {name: mesh.face_sets[name] for name in names if name in mesh.face_sets}
        sets = {name: mesh.node_sets[name] for name in names if name in mesh.node_sets and name not in faces}
        nodes = {name: mesh.points[result] for name, result in sets.items()} | points
        pictures = run.step("pictures of the mesh").run(face_pictures, mesh, faces, stations, opened.title, nodes)
        files += write_contents(run, stem, pictures)
        files += [file for file, _ in picture_modes(model.reduced.shapes, stem, run)]
    except MissingSoftware as error:
        run.warn(f"there are no pictures: {error}")
    return files


def _list_faces(entry: object) -> list[str]:
    on, edge = getattr(entry, "on", None), getattr(entry, "edge", None)
    return [name for name in (on, *(edge or ())) if name is not None]
