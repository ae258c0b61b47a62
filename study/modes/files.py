"""Pictures, film and VTU file of mode shapes, and the answer of ``stickslip modes``; drawn pictures are stored."""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe.file.mesh_file import write_mesh
from figure.scene.mode_picture import ModeColour, mode_animation, mode_picture
from pipeline.output import replace_file
from pipeline.store import stage
from study.modes.shapes import Shapes
from study.run_context import Answer, RunContext
from study.run_record import note_pictures

#: Time to draw a film, in pictures.
FILM_WORK = 8
#: Time for six modes and their stress per 10,000 degrees of freedom, as a first estimate for the progress [s].
MODE_SECONDS = 0.8


@stage("mode pictures", ignore=("report",))
def mode_pictures(
    shapes: Shapes, elastic: int, moving: int, report: Callable[[float, float], None]
) -> dict[str, NDArray[np.uint8]]:
    """Draw the modes: bytes of each picture file by name, such as ``mode1.png``."""
    n_mode = len(shapes.frequency)

    def look(mode: int) -> dict[str, Any]:
        return {"frequency": float(shapes.frequency[mode]), "title": f"Mode {mode + 1}"}

    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        for number, displacement in enumerate(shapes.displacement):
            mode_picture(shapes.mesh, displacement, folder / f"mode{number + 1}.png", **look(number))
            report(number + 1, n_mode + FILM_WORK)
        stress, shape = folder / f"mode{elastic + 1}_stress.png", shapes.displacement[elastic]
        von_mises = ModeColour(field="von_mises", values=shapes.von_mises[elastic])
        mode_picture(shapes.mesh, shape, stress, colour=von_mises, **look(elastic))
        film = folder / f"mode{moving + 1}.gif"
        mode_animation(shapes.mesh, shapes.displacement[moving], film, **look(moving))
        return contents(folder)


def contents(folder: Path) -> dict[str, NDArray[np.uint8]]:
    """Bytes of each file of a folder by its name, in the form that stages return."""
    return {file.name: np.frombuffer(file.read_bytes(), dtype=np.uint8) for file in sorted(folder.iterdir())}


def write_contents(run: RunContext, stem: str, pictures: Mapping[str, NDArray[np.uint8]]) -> list[Path]:
    """Write files from the bytes that a stage returned; each is named by the stem and its key."""
    assert run.output is not None
    files = [run.output / f"{stem}_{name}" for name in pictures]
    for file, content in zip(files, pictures.values(), strict=True):
        replace_file(file, content.tobytes())
    note_pictures(files)
    return files


def picture_modes(shapes: Shapes, stem: str, run: RunContext, film_of: int | None = None) -> list[tuple[Path, str]]:
    """Draw every mode, the von Mises stress of the first elastic mode, and a film of one mode.

    Parameters
    ----------
    shapes
        Modes.
    stem
        Stem of the file names: ``stem_mode1.png`` and so on.
    run
        Output folder, store and progress.
    film_of
        Mode of the GIF film, counted from 0; None for the first elastic one.

    Returns
    -------
    Files and their captions.
    """
    # An unsupported body has rigid-body modes at 0 Hz.
    elastic = min(int((shapes.frequency == 0).sum()), len(shapes.frequency) - 1)
    moving = elastic if film_of is None else film_of
    step = run.step("pictures")
    drawn = step.run(mode_pictures, shapes, elastic, moving, step.report)
    captions = {
        **{f"mode{number + 1}.png": f"Mode {number + 1}, displacement" for number in range(len(shapes.frequency))},
        f"mode{elastic + 1}_stress.png": f"Mode {elastic + 1}, von Mises stress",
        f"mode{moving + 1}.gif": f"Mode {moving + 1} over one period",
    }
    files = write_contents(run, stem, {name: drawn[name] for name in captions})
    return list(zip(files, captions.values(), strict=True))


def write_shapes(shapes: Shapes, stem: str, film_of: int | None, run: RunContext) -> Answer:
    """Write pictures and a film, unless the run draws none, and a VTU file of all modes.

    Parameters
    ----------
    shapes
        Modes.
    stem
        Stem of the file names.
    film_of
        Mode of the film, counted from 1; None for the first elastic one.
    run
        Output folder, store and progress of the run.
    """
    assert run.output is not None
    files: list[Path] = []
    if run.pictures:
        files += [file for file, _ in picture_modes(shapes, stem, run, None if film_of is None else film_of - 1)]
    files.append(run.output / f"{stem}_modes.vtu")
    write_mesh(shapes.mesh, files[-1], shapes.fields)
    lines = [f"{shapes.n_dof} degrees of freedom", ""]
    lines += [f"  mode {number:3}  {frequency:12.4f} Hz" for number, frequency in enumerate(shapes.frequency, start=1)]
    document = {
        "n_dof": shapes.n_dof,
        "frequency_hz": [float(frequency) for frequency in shapes.frequency],
        "files": [str(file) for file in files],
    }
    return Answer(document=document, text="\n".join([*lines, "", *map(str, files)]))
