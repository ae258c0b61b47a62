"""``stickslip modes``: from a case file or a mesh file to mode shapes."""

import warnings
from dataclasses import dataclass
from pathlib import Path

from casefile.quantity import LENGTH, MATERIAL_DENSITY, YOUNGS_MODULUS, Dimension, read_quantity
from fe.errors import SupportError
from fe.file.mesh_file import read_mesh
from fe.material import Material
from fe.mesh import Mesh
from figure.scene.off_screen import require_egl
from geometry.errors import InputError, InputWarning
from study.case.kind import open_case
from study.modes.report import MODE_SECONDS, write_modes
from study.modes.shapes import mesh_shapes
from study.run_context import Answer, RunContext


@dataclass(frozen=True, kw_only=True)
class OwnMesh:
    """What a mesh file does not say: unit, material and supports, as the user typed them."""

    length_unit: str | None
    young: str
    poisson: float
    density: str
    fixed: tuple[str, ...]
    free: bool


def run_modes(source: Path, own: OwnMesh, n_mode: int, film_of: int | None, run: RunContext) -> Answer:
    """Compute the modes and write pictures, a film and a VTU file that holds all modes.

    Parameters
    ----------
    source
        A case file (``.toml``) or a mesh file.
    own
        For a mesh file.
    n_mode, film_of
        How many modes [-], and which of them moves, counted from 1; None for the first elastic one.
    run
        Output folder, store and progress.

    Raises
    ------
    InputError
        What is asked cannot be done; one sentence.
    """
    require_egl()
    if n_mode < 1:
        raise InputError(f"--n-modes {n_mode} is no number of modes: give 1 or more")
    if film_of is not None and not 1 <= film_of <= n_mode:
        raise InputError(f"--film {film_of} is none of the {n_mode} modes: give 1 to {n_mode}")
    if source.suffix == ".toml":
        opened = open_case(source)
        if isinstance(opened.kind.modes, str):
            raise opened.lacks(
                "structure", f"`stickslip modes` draws no case of {opened.kind.summary}: {opened.kind.modes}"
            )
        if own.fixed or own.free or own.length_unit is not None:
            raise InputError(
                f"--fix, --free and --length-unit are for mesh files, but {source} is a case file, which says all that "
                "itself: leave them out"
            )
        return opened.kind.modes(opened, run, n_mode, film_of)
    mesh, material = _own_mesh(source, own)
    try:
        step = run.step("modes", expected=MODE_SECONDS * 3 * mesh.n_node / 1e4)
        shapes = step.run(mesh_shapes, mesh, material, own.fixed, n_mode)
    except SupportError as error:
        raise SupportError(f"{source} with --fix {' --fix '.join(own.fixed)}: {error}") from None
    return write_modes(shapes, source.stem, film_of, run)


def _own_mesh(source: Path, own: OwnMesh) -> tuple[Mesh, Material]:
    if own.length_unit is None:
        raise InputError(f"{source} holds numbers without a unit: say which, such as --length-unit mm")
    unit = _typed("--length-unit", own.length_unit, LENGTH, number="1 ")
    young, density = _typed("--young", own.young, YOUNGS_MODULUS), _typed("--density", own.density, MATERIAL_DENSITY)
    try:
        material = Material(young=young, poisson=own.poisson, density=density)
    except InputError as error:  # it names its field, which is the option
        name, _, value = str(error).partition(" = ")
        raise InputError(f"--{name} {value}") from None
    mesh = read_mesh(source, length_unit_in_metre=unit)
    known = ", ".join(sorted({*mesh.node_sets, *mesh.face_sets})) or "no sets"
    if own.free and own.fixed:
        raise SupportError("--free and --fix contradict each other: leave one out")
    if not own.free and not own.fixed:
        raise SupportError(f"{source} is held nowhere: name a set with --fix (it has {known}), or say --free")
    for name in own.fixed:
        if name not in mesh.node_sets and name not in mesh.face_sets:
            raise SupportError(f"--fix {name}: {source} has no such set, it has {known}")
    return mesh, material


def _typed(option: str, text: str, dimension: Dimension, number: str = "") -> float:
    try:
        value = read_quantity(number + text, dimension)
    except ValueError as error:
        raise InputError(f'{option} "{text}": {error}') from None
    doubt = dimension.plausibility.doubt(value, text) if dimension.plausibility else ""
    if doubt:
        warnings.warn(f'{option} "{text}": {doubt}', InputWarning, stacklevel=3)
    return value
