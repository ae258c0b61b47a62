"""``stickslip reduce``: make a reduced model from a case file."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_openblas_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, make_command_app

app = make_command_app(
    "reduce",
    """A blade: builds the CAD solid, meshes and clamps it, and retains excitation, response and contact nodes and the
    lowest fixed-interface modes. Writes the STEP file, the mesh (VTU), the reduced model (HDF5, docs/rom_file.md)
    and the frequency response of the tip, and compares reduced frequencies with full ones. Without a case file: the
    rig's blade.

    A rig (kind = "rig", docs/rig.md): the same for each of its five bodies. Writes the STEP assembly, the meshes with
    the first modes (VTU), the reduced assembly (HDF5) and pictures, and prints the frequencies of the rig with all
    contacts stuck.

    Your own part (kind = "part", docs/own_part.md): a STEP file, filled with tetrahedra, or a mesh file, with named
    faces, points and contact lines. Writes the mesh with the first modes (VTU), the reduced model, tables of
    frequencies and stations, and pictures.

    Matrices (kind = "matrices", docs/matrices.md): mass and stiffness from ANSYS, Nastran, CalculiX or MatrixMarket
    files. Writes the reduced model, and compares reduced frequencies with full ones.""",
    examples=["stickslip reduce --out reduced", "stickslip reduce my_rig.toml --out mine --json"],
)


@app.default
def reduce(
    case: Annotated[Path | None, Parameter(help="Case file; default: the blade of the rig.")] = None,
    /,
    *,
    out: Out = Path("reduced"),
    check: Annotated[
        bool,
        Parameter(
            help="Check the fixed-interface modes: residuals, and a count that detects missed ones; it takes up to "
            "two thirds of the time of the reduction.",
            negative=(),
        ),
    ] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Reduce a blade, a rig, a part or matrices."""
    set_one_openblas_thread_by_default()
    from study.kind.registry import open_case
    from study.shipped_cases import BLADE

    opened = open_case(case or BLADE)
    if isinstance(opened.kind.reduce, str):
        summary = opened.kind.summary
        raise opened.lacks(
            "structure", f"`stickslip reduce` does not apply to a case of {summary}: {opened.kind.reduce}"
        )
    return opened.kind.reduce(opened, options.open(out), check)
