"""Files of modes, and what ``stickslip modes`` says of them."""

from fe.file.mesh_file import write_mesh
from study.modes.files import picture_modes
from study.modes.shapes import Shapes
from study.run_context import Answer, RunContext

#: Six modes and their stress take about this long per 10,000 degrees of freedom, until a run knows better [s].
MODE_SECONDS = 0.8


def write_modes(shapes: Shapes, stem: str, film_of: int | None, run: RunContext) -> Answer:
    """Write pictures, a film and a VTU file that holds all modes.

    Parameters
    ----------
    shapes
        The modes.
    stem
        What the files are called.
    film_of
        Mode that moves, counted from 1; None for the first elastic one.
    run
        Where to.
    """
    assert run.output is not None
    files = [file for file, _ in picture_modes(shapes, stem, run, None if film_of is None else film_of - 1)]
    files.append(run.output / f"{stem}_modes.vtu")
    fields = {f"mode {k + 1}: {f:.6g} Hz": shapes.displacement[k] for k, f in enumerate(shapes.frequency)}
    write_mesh(shapes.mesh, files[-1], fields)
    lines = [f"{shapes.n_dof} degrees of freedom", ""]
    lines += [f"  mode {number:3}  {frequency:12.4f} Hz" for number, frequency in enumerate(shapes.frequency, start=1)]
    document = {
        "n_dof": shapes.n_dof,
        "frequency_hz": [float(frequency) for frequency in shapes.frequency],
        "files": [str(file) for file in files],
    }
    return Answer(document=document, text="\n".join([*lines, "", *map(str, files)]))
