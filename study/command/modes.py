"""``stickslip modes``: natural frequencies and mode shapes as pictures."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import one_openblas_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, command_app

app = command_app(
    "modes",
    """Compute natural frequencies and draw the mode shapes of a blade or of your own mesh.

    SOURCE is a case file (.toml; without one, the rig's blade) or a mesh (.inp, .msh, .vtu, .bdf, .nas) of 8- or
    20-node hexahedra or 10-node tetrahedra with named sets. A mesh file needs its length unit, and what holds it.
    Writes a picture of each mode, the von Mises stress of the first, a film, and a VTU file with all modes for
    ParaView. The modes of a rig or of a part are drawn by `stickslip reduce`.""",
    examples=[
        "stickslip modes --out modes",
        "stickslip modes part.inp --length-unit mm --fix CLAMP",
        'stickslip modes part.msh --length-unit mm --free --young "70 GPa" --density "2700 kg/m^3"',
    ],
)


@app.default
def modes(
    source: Annotated[Path | None, Parameter(help="Case file or mesh file.")] = None,
    /,
    *,
    n_modes: Annotated[int, Parameter(help="How many modes.")] = 6,
    fix: Annotated[
        tuple[str, ...], Parameter(help="Node or face set that is held; may be repeated.", negative="")
    ] = (),
    free: Annotated[bool, Parameter(help="Nothing holds the mesh.", negative="")] = False,
    length_unit: Annotated[str | None, Parameter(help="Unit of the mesh file's coordinates, such as mm.")] = None,
    young: Annotated[str, Parameter(help="Young's modulus of the mesh.", allow_leading_hyphen=True)] = "210 GPa",
    poisson: Annotated[float, Parameter(help="Poisson's ratio of the mesh.")] = 0.3,
    density: Annotated[str, Parameter(help="Density of the mesh.", allow_leading_hyphen=True)] = "7800 kg/m^3",
    film: Annotated[int | None, Parameter(help="Mode that moves in the GIF; the first elastic one by default.")] = None,
    out: Out = Path("modes"),
    options: Options = DEFAULTS,
) -> Answer:
    """Compute and draw modes."""
    one_openblas_thread_by_default()
    from study.modes.run import OwnMesh, run_modes
    from study.shipped import BLADE

    own = OwnMesh(length_unit=length_unit, young=young, poisson=poisson, density=density, fixed=fix, free=free)
    return run_modes(source or BLADE, own, n_modes, film, options.open(out))
