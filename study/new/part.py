"""A first case of a part from a STEP or a mesh file: faces or sets are listed, and one of them is fixed."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import InputError, MissingSoftware
from geometry.part import MILLIMETRES_PER_METRE
from study.new.draft import REDUCTION, STEEL, CaseDraft, NewCaseRequest, key
from study.run_context import RunContext

if TYPE_CHECKING:
    from geometry.listed_faces import ListedFace

Vector = Float[NDArray[np.float64], " 3"]
#: Approximate number of cells of a STEP part, for half a minute of meshing; approximate number in a cube of the edge
#: length of a cell.
CELLS, CELLS_PER_CUBE = 10_000, 16.0
#: Reason for the default of the fixed face.
END = "the face at an end of the longest side"
#: Words in the names of sets that are usually fixed, the most reliable first.
FIXED_WORDS = ("fix", "clamp", "support", "spc", "root", "ground")


def draft_part(request: NewCaseRequest, run: RunContext) -> CaseDraft:
    """Draft a part that is fixed at a face or set, with a retained point far from it."""
    from study.kind.part.table import STEP_SUFFIXES

    if len(request.files) != 1:
        raise InputError("name the one STEP or mesh file of the part")
    (file,) = request.files
    return (_step if file.suffix.lower() in STEP_SUFFIXES else _mesh)(file, request, run)


def _step(file: Path, request: NewCaseRequest, run: RunContext) -> CaseDraft:
    from geometry.listed_faces import corner_points, list_faces
    from geometry.step_part import read_body
    from geometry.system_library import require_system_libraries

    require_system_libraries("cad")
    with run.progress.step("read the solid"):
        body = read_body(file)
        faces = list_faces(body)
    corners = np.concatenate([face.corners for face in faces])
    notes = [_format_faces(faces)]
    pictures = _draw_faces(faces, request.path, run)
    if pictures:
        notes.append(f"their numbers are in {pictures[0]}")
    run.note("\n".join(notes))
    chosen, why = _choose_fixed(request, "Number of the face that is fixed?", str(_find_end_face(faces, corners)), END)
    fixed = [_read_number(word, faces) for word in chosen]
    middle = np.mean([faces[number].inside for number in fixed], axis=0)
    known = corner_points(body)
    known = known if len(known) else np.array([face.inside for face in faces])
    tip = known[int(np.linalg.norm(known - middle, axis=1).argmax())]
    edge = (CELLS_PER_CUBE * float(body.solid.Volume()) / CELLS) ** (1 / 3)
    mesh_size = request.given.get("size", f"{float(f'{edge:.2g}'):g} mm")
    names = [f"face {number + 1}" for number in fixed]
    text = f"""\
[structure]
kind = "part"
file = {request.relative(file)}

{STEEL}
[structure.mesh]
# Edge length of the tetrahedra: coarse, for a first look. Smaller ones at a face: near = {{ "{names[0]}" = "1 mm" }}
size = "{mesh_size}"

# Names for faces of the solid. Other keys than at: normal, area, colour, step_name (docs/own_part.md).
{"".join(_make_face_table(name, faces[number]) for name, number in zip(names, fixed, strict=True))}[[structure.support]]
on = [{", ".join(f'"{name}"' for name in names)}]{why}

{_point(tip)}
{REDUCTION.format(modes=30)}"""
    return CaseDraft(text=text, notes=tuple(notes), pictures=pictures)


def _mesh(file: Path, request: NewCaseRequest, run: RunContext) -> CaseDraft:
    from casefile.quantity import LENGTH
    from fe.file.file_material import read_file_material
    from fe.file.mesh_file import read_mesh

    unit = request.value(
        "length-unit", "Unit of the lengths in the mesh file?", "mm", "mesh files do not contain it", ("mm", "m")
    )
    mesh = read_mesh(file, LENGTH.read(f"1 {unit.value}"))
    carried = read_file_material(file, LENGTH.read(f"1 {unit.value}"))
    sets = {name: len(mesh.nodes(name)) for name in (*mesh.node_sets, *mesh.face_sets)}
    if not sets:
        raise InputError(
            f"{file} has no named sets of nodes or faces, so nothing can be fixed by name: name the fixed face in "
            "your mesher (docs/own_part.md lists what is a set in each format)"
        )
    listed = "\n".join(
        ["  set                       nodes", *(f"  {name:24} {count:6}" for name, count in sets.items())]
    )
    run.note(listed)
    likely = [name for word in FIXED_WORDS for name in sets if word in name.lower()] or list(sets)
    chosen, _ = _choose_fixed(request, "Which set is fixed?", likely[0], "a part needs a support", tuple(sets))
    for name in chosen:
        if name not in sets:
            raise InputError(f"--fix {name}: {file} has no such set; it has {', '.join(sets)}")
    fixed = np.unique(np.concatenate([mesh.nodes(name) for name in chosen]))
    middle = mesh.points[fixed].mean(axis=0)
    tip = mesh.points[int(np.linalg.norm(mesh.points - middle, axis=1).argmax())]
    material = f"# The material is that of {file.name}.\n"
    if carried.material is None:
        material = STEEL if not carried.obstacle else f"# Assumed, since {carried.obstacle}:\n{STEEL}"
    text = f"""\
[structure]
kind = "part"
file = {request.relative(file)}
{key("length_unit", unit)}

{material}
[[structure.support]]
on = [{", ".join(f'"{name}"' for name in chosen)}] # sets of the file: {", ".join(sets)}

{_point(tip)}
{REDUCTION.format(modes=30)}"""
    return CaseDraft(text=text, notes=(listed,))


def _choose_fixed(
    request: NewCaseRequest, question: str, default: str, why: str, choices: Sequence[str] = ()
) -> tuple[tuple[str, ...], str]:
    """Choose the fixed faces or sets; return also a comment if the choice is assumed."""
    if request.fix:
        return request.fix, ""
    answer = request.value("fix", question, default, why, choices)
    return (str(answer.value),), f" # assumed: {answer.assumed}" if answer.assumed else ""


def _point(tip: Vector) -> str:
    return f"""\
# A point of the surface that stays a coordinate, wherever the nodes are: here the corner farthest from the support.
[[structure.point]]
name = "tip"
at = [{_format_lengths(tip)}]
"""


def _format_lengths(values: Vector) -> str:
    return ", ".join(f'"{value * MILLIMETRES_PER_METRE + 0.0:.9g} mm"' for value in values)


def _format_faces(faces: Sequence["ListedFace"]) -> str:
    lines = [
        f"  {number:4}  {face.kind:10} {face.area * MILLIMETRES_PER_METRE**2:13.2f}   "
        f"({', '.join(f'{x * MILLIMETRES_PER_METRE + 0.0:.2f}' for x in face.centre)})  {face.name}".rstrip()
        for number, face in enumerate(faces, start=1)
    ]
    return "\n".join(["  face  kind         area [mm^2]   centre [mm]", *lines])


def _draw_faces(faces: Sequence["ListedFace"], path: Path, run: RunContext) -> tuple[Path, ...]:
    from figure.scene.numbered_faces import save_numbered_faces

    file = path.with_name(f"{path.stem}_faces.png")
    try:
        surfaces = [(face.corners, face.triangles) for face in faces]
        return (save_numbered_faces(surfaces, file, title=f"Faces of {path.stem}"),)
    except MissingSoftware as reason:
        run.warn(f"no picture of the faces: {reason}")
        return ()


def _read_number(word: str, faces: Sequence["ListedFace"]) -> int:
    if not word.isdigit() or not 1 <= int(word) <= len(faces):
        raise InputError(f"--fix {word}: the faces have the numbers 1 to {len(faces)}")
    return int(word) - 1


def _find_end_face(faces: Sequence["ListedFace"], corners: Float[NDArray[np.float64], "corner 3"]) -> int:
    """Find the number of the plane face at the lower end of the longest side; of the largest face if there is none."""
    axis = int(np.ptp(corners, axis=0).argmax())
    ends = [number for number, face in enumerate(faces) if face.normal is not None and face.normal[axis] < -0.99]
    pick = min(ends, key=lambda number: faces[number].centre[axis], default=None)
    return 1 + (pick if pick is not None else int(np.argmax([face.area for face in faces])))


def _make_face_table(name: str, face: "ListedFace") -> str:
    return f'[[structure.face]]\nname = "{name}"\nat = [{_format_lengths(face.inside)}]\n\n'
