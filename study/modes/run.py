"""``stickslip modes``: from a case file or a mesh file to mode shapes."""

import warnings
from dataclasses import dataclass
from pathlib import Path

from casefile.quantity import LENGTH, MATERIAL_DENSITY, YOUNGS_MODULUS, Dimension, read_quantity
from casefile.table import load_case, located
from fe.errors import SupportError
from fe.file.mesh_file import read_mesh, write_mesh
from fe.material import Material
from fe.mesh import Mesh
from figure.scene.off_screen import require_egl
from geometry.errors import InputError, InputWarning
from study.kind.blade.model import blade_model, mesh_size
from study.kind.blade.table import BladeCase
from study.kind.part.table import refuse_part
from study.kind.rig.table import refuse_rig
from study.modes.files import picture_modes
from study.modes.shapes import Shapes, blade_shapes, mesh_shapes
from study.run_context import RunContext

#: Six modes and their stress take about this long for each 10,000 degrees of freedom, until a run knows better [s].
MODE_SECONDS = 0.8


@dataclass(frozen=True, kw_only=True)
class OwnMesh:
    """What a mesh file does not say: unit, material and supports, as the user typed them."""

    length_unit: str | None
    young: str
    poisson: float
    density: str
    fixed: tuple[str, ...]
    free: bool


def run_modes(
    source: Path, own: OwnMesh, n_mode: int, film_of: int | None, run: RunContext
) -> tuple[Shapes, list[Path]]:
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
    assert run.output is not None
    require_egl()
    if n_mode < 1:
        raise InputError(f"--n-modes {n_mode} is no number of modes: give 1 or more")
    if film_of is not None and not 1 <= film_of <= n_mode:
        raise InputError(f"--film {film_of} is none of the {n_mode} modes: give 1 to {n_mode}")
    if source.suffix == ".toml":
        refuse_part(source, f"`stickslip reduce {source}` computes and draws its modes")
        refuse_rig(source, f"`stickslip reduce {source}` computes and draws its modes, with all contacts stuck")
        case = load_case(source, BladeCase)
        model = blade_model(case, element=case.mesh.element, through_thickness=case.mesh.elements_through_thickness)
        if own.fixed or own.free or own.length_unit is not None:
            raise InputError(
                f"--fix, --free and --length-unit are for mesh files, but {source} is a case file, which says all that "
                "itself: leave them out"
            )
        with located(case, "mesh"):
            n_dof = run.store.run(mesh_size, model)
        shapes = run.step("modes", expected=MODE_SECONDS * n_dof / 1e4).run(blade_shapes, model, n_mode)
    else:
        mesh, material = _own_mesh(source, own)
        try:
            step = run.step("modes", expected=MODE_SECONDS * 3 * mesh.n_node / 1e4)
            shapes = step.run(mesh_shapes, mesh, material, own.fixed, n_mode)
        except SupportError as error:
            raise SupportError(f"{source} with --fix {' --fix '.join(own.fixed)}: {error}") from None
    moving = None if film_of is None else film_of - 1
    files = [file for file, _ in picture_modes(shapes, source.stem, run, moving)]
    result = run.output / f"{source.stem}_modes.vtu"
    fields = {f"mode {k + 1}: {f:.6g} Hz": shapes.displacement[k] for k, f in enumerate(shapes.frequency)}
    write_mesh(shapes.mesh, result, fields)
    return shapes, [*files, result]


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
