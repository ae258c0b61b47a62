"""``stickslip reduce``: from a case file to a reduced model."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from pipeline.blas_threads import one_openblas_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, command_app

if TYPE_CHECKING:
    from fe.mode_check import ModeCheck
    from study.kind.blade.reduction import Reduction
    from study.reduce.comparison import ComparedReduction

app = command_app(
    "reduce",
    """Reduce a blade, the whole rig, your own part, or matrices of another program by Craig-Bampton.

    A blade: builds the CAD solid, meshes and clamps it, keeps excitation, response and contact nodes and the lowest
    fixed-interface modes. Writes the STEP file, the mesh (VTU), the reduced model (HDF5, docs/rom_file.md) and the
    frequency response of the tip, and compares reduced frequencies with full ones. Without a case file: the rig's
    blade.

    A rig (a case file with kind = "rig", docs/rig.md): the same for each of its five bodies. Writes the STEP assembly,
    the meshes with the first modes (VTU), the reduced assembly (HDF5) and pictures, and prints the frequencies of the
    rig with all contacts stuck.

    Your own part (kind = "step" or "mesh", docs/own_part.md): a STEP file, filled with tetrahedra, or a mesh file, with
    named faces, points and contact lines. Writes the mesh with the first modes (VTU), the reduced model, tables of
    frequencies and stations, and pictures.

    Matrices (kind = "matrices", docs/matrices.md): mass and stiffness from ANSYS, Nastran, CalculiX or MatrixMarket
    files. Writes the reduced model, and compares reduced frequencies with full ones.""",
    examples=["stickslip reduce --out reduced", "stickslip reduce my_rig.toml --out mine --json"],
)


@app.default
def reduce(
    case: Annotated[Path | None, Parameter(help="Case file.")] = None,
    /,
    *,
    out: Out = Path("reduced"),
    check: Annotated[
        bool,
        Parameter(
            help="Check the fixed-interface modes: residuals, and a count that finds missed ones; it takes up to two "
            "thirds of the reduction's time.",
            negative=(),
        ),
    ] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Reduce a blade, a rig, a part or matrices."""
    one_openblas_thread_by_default()
    from study.kind.matrices.table import is_matrices_case
    from study.kind.part.table import part_kind
    from study.kind.rig.table import is_rig_case
    from study.shipped import BLADE

    path = case or BLADE
    if is_matrices_case(path):
        return _matrices(path, out, check, options)
    if part_kind(path) is not None:
        return _part(path, out, check, options)
    return _rig(path, out, check, options) if is_rig_case(path) else _blade(path, out, check, options)


def _rig(path: Path, out: Path, check: bool, options: Options) -> Answer:
    from study.kind.rig.reduce import run_reduce_rig
    from study.kind.rig.reduce_report import rig_document, rig_text

    reduced = run_reduce_rig(path, options.open(out), checked=check)
    return Answer(document=rig_document(reduced), text=rig_text(reduced))


def _matrices(path: Path, out: Path, check: bool, options: Options) -> Answer:
    from study.kind.matrices.reduce import run_reduce_matrices

    reduced = run_reduce_matrices(path, options.open(out), checked=check)
    files = [str(file) for file in reduced.files]
    return Answer(
        document={**_frequency_document(reduced.reduction, reduced.check), "files": files},
        text="\n".join([*_frequency_lines(reduced.reduction, reduced.n_mode, reduced.check), "", *files]),
    )


def _part(path: Path, out: Path, check: bool, options: Options) -> Answer:
    from study.kind.part.reduce import run_reduce_part
    from study.kind.part.reduce_report import face_document, face_lines

    reduced = run_reduce_part(path, options.open(out), checked=check)
    found, mesh = reduced.reduction, reduced.mesh
    files = [str(file) for file in reduced.files]
    return Answer(
        document={
            **_frequency_document(found, reduced.check),
            "n_node": mesh.n_node,
            "n_element": mesh.n_cell,
            "least_scaled_jacobian": reduced.least_scaled_jacobian,
            "mended": list(reduced.notes),
            **({"faces": face_document(reduced.faces)} if reduced.faces else {}),
            "boundary": {name: len(rows) for name, rows in found.rom.boundary_sets.items()},
            "files": files,
        },
        text="\n".join(
            [
                *face_lines(reduced.faces),
                *([""] if reduced.faces else []),
                f"{mesh.n_cell} elements, worst scaled Jacobian {reduced.least_scaled_jacobian:.2f}",
                *_frequency_lines(found, reduced.n_mode, reduced.check),
                "",
                *files,
            ]
        ),
    )


def _blade(path: Path, out: Path, check: bool, options: Options) -> Answer:
    from study.kind.blade.reduce import run_reduce

    reduced = run_reduce(path, options.open(out), checked=check)
    found = reduced.reduction
    lines = [
        *_frequency_lines(found, reduced.n_mode, reduced.check),
        "",
        f"  first, from the peak of the harmonic-balance response: {found.peak_natural:.5f} Hz",
        "",
        *map(str, reduced.files),
    ]
    document = {
        **_frequency_document(found, reduced.check),
        "hb_peak_hz": found.peak_natural,
        "files": [str(file) for file in reduced.files],
    }
    return Answer(document=document, text="\n".join(lines))


def _frequency_lines(found: "Reduction | ComparedReduction", n_asked: int, check: "ModeCheck | None") -> list[str]:
    """The frequencies, and what must be known of them; `n_asked` modes were to be kept."""
    from study.reduce.mode_check import check_sentence
    from study.reduce.mode_count import fewer_modes

    return [
        f"{found.n_dof} degrees of freedom reduced to {found.rom.n_dof}",
        *fewer_modes(len(found.rom.fixed_interface_frequency), n_asked),
        "",
        "  mode      full [Hz]   reduced [Hz]   estimated truncation error",
        *(
            f"  {number:4} {full:14.5f} {rom:14.5f}   {error:26.1e}"
            for number, (full, rom, error) in enumerate(
                zip(found.frequency, found.rom_frequency, found.rom_error, strict=True), start=1
            )
        ),
        "",
        "  The error is that of the modes left out alone: what the full model errs, as by its mesh, is not in it.",
        *([] if check is None else ["", f"  {check_sentence(check)}"]),
    ]


def _frequency_document(found: "Reduction | ComparedReduction", check: "ModeCheck | None") -> dict[str, Any]:
    from study.reduce.mode_check import check_document

    return {
        "n_dof": found.n_dof,
        "n_reduced": found.rom.n_dof,
        "n_mode": len(found.rom.fixed_interface_frequency),
        "frequency_hz": list(map(float, found.frequency)),
        "rom_frequency_hz": list(map(float, found.rom_frequency)),
        "rom_error": list(map(float, found.rom_error)),
        **({} if check is None else {"mode_check": check_document(check)}),
    }
