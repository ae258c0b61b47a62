"""``stickslip modes``: from a case file or a mesh file to natural frequencies and mode shapes."""

from pathlib import Path

from fe.errors import SupportError, UnsupportedBody
from figure.scene.off_screen import require_egl
from geometry.errors import InputError
from study.kind.registry import open_case
from study.modes.files import MODE_SECONDS, write_shapes
from study.modes.own_mesh import OwnMesh
from study.modes.shapes import compute_mesh_shapes
from study.modes.table import write_modes_table
from study.run_context import Answer, RunContext


def run_modes(source: Path, own: OwnMesh, n_mode: int, film_of: int | None, run: RunContext) -> Answer:
    """Compute the modes and write pictures, a film and a VTU file of all modes, or a table for a case without a mesh.

    Parameters
    ----------
    source
        Case file (``.toml``) or mesh file.
    own
        Options for a mesh file.
    n_mode, film_of
        Number of modes [-], and number of the mode in the film, counted from 1; None for the first elastic one.
    run
        Output folder, store and progress.

    Raises
    ------
    InputError
        If an option cannot be used; the message is one sentence.
    """
    if n_mode < 1:
        raise InputError(f"--n-modes {n_mode} is not a valid number of modes: give 1 or more")
    if film_of is not None and not 1 <= film_of <= n_mode:
        raise InputError(f"--film {film_of} is not one of the {n_mode} modes: give 1 to {n_mode}")
    if film_of is not None and not run.pictures:
        raise InputError(f"--film {film_of} needs pictures: remove it or --no-pictures")
    if source.suffix == ".toml":
        opened = open_case(source)
        draw, summary = opened.kind.modes, opened.kind.summary
        if isinstance(draw, str):
            raise opened.lacks("structure", f"`stickslip modes` does not draw a case of {summary}: {draw}")
        if own.is_given:
            raise InputError(
                f"--fix, --free and --length-unit are for mesh files, but {source} is a case file, which contains "
                "this information: remove them"
            )
        if draw is None:
            if film_of is not None:
                raise InputError(f"--film {film_of}: {summary} have no mesh to animate: remove it")
            return write_modes_table(opened, run, n_mode)
        if run.pictures:
            require_egl()
        return draw(opened, run, n_mode, film_of)
    if run.pictures:
        require_egl()
    mesh, material = own.read(source, run)
    try:
        step = run.step("modes", expected=MODE_SECONDS * 3 * mesh.n_node / 1e4)
        shapes = step.run(compute_mesh_shapes, mesh, material, own.fix, n_mode)
    except SupportError as error:
        raise SupportError(f"{source} with --fix {' --fix '.join(own.fix)}: {error}{_suggest_remedy(error)}") from None
    return write_shapes(shapes, source.stem, film_of, run)


def _suggest_remedy(error: SupportError) -> str:
    """Further remedy if one of several bodies is not supported; empty otherwise."""
    if not isinstance(error, UnsupportedBody):
        return ""
    return (
        '; where bodies touch, contacts of a case of kind "part" join them (docs/own_part.md, "Two bodies that '
        'touch"), or common nodes, merged in your mesher'
    )
