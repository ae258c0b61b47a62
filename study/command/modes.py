"""``stickslip modes``: natural frequencies and mode shapes as pictures."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_openblas_thread_by_default
from study.modes.own_mesh import NO_MESH, OwnMesh
from study.run_context import DEFAULTS, Answer, Options, Out, make_command_app

app = make_command_app(
    "modes",
    """SOURCE is a case file (.toml; without one, the rig's blade) or a mesh (.inp, .msh, .vtu, .bdf, .nas) of 8- or
    20-node hexahedra or 10-node tetrahedra with named sets. A mesh file needs --length-unit, and --fix or --free.
    Writes a picture of each mode, the von Mises stress of the first, a film, and a VTU file with all modes for
    ParaView; with --no-pictures only the VTU file, without a graphics library. For plain matrices and matrices of
    another program it writes a table of natural frequencies and damping ratios. The modes of a rig or of a part
    are drawn by `stickslip reduce`.""",
    examples=[
        "stickslip modes --out modes",
        "stickslip modes part.inp --length-unit mm --fix CLAMP",
        'stickslip modes part.msh --length-unit mm --free --young "70 GPa" --density "2700 kg/m^3"',
    ],
)


@app.default
def modes(
    source: Annotated[Path | None, Parameter(help="Case file or mesh file; default: the blade of the rig.")] = None,
    /,
    *,
    n_modes: Annotated[int, Parameter(help="Number of modes.")] = 6,
    mesh: OwnMesh = NO_MESH,
    pictures: Annotated[bool, Parameter(help="Draw pictures and a film, which takes most of the time.")] = True,
    film: Annotated[int | None, Parameter(help="Mode animated in the GIF; default: the first elastic one.")] = None,
    out: Out = Path("modes"),
    options: Options = DEFAULTS,
) -> Answer:
    """Compute and draw modes."""
    set_one_openblas_thread_by_default()
    from study.modes.run import run_modes
    from study.shipped_cases import BLADE

    run = options.open(out)
    return run_modes(source or BLADE, mesh, n_modes, film, run if pictures else replace(run, pictures=False))
