"""Pictures and files of mode shapes, and what ``stickslip modes`` says of them; what was drawn is stored."""

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

#: A film takes as long as so many pictures.
FILM_WORK = 8
#: Six modes and their stress take about this long per 10,000 degrees of freedom, until a run knows better [s].
MODE_SECONDS = 0.8


@stage("mode pictures", ignore=("report",))
def mode_pictures(
    shapes: Shapes, elastic: int, moving: int, report: Callable[[float, float], None]
) -> dict[str, NDArray[np.uint8]]:
    """Bytes of each picture file by name, such as ``mode1.png``."""
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
    """Bytes of each file of a folder by its name, as stages return them."""
    return {file.name: np.frombuffer(file.read_bytes(), dtype=np.uint8) for file in sorted(folder.iterdir())}


def write_contents(run: RunContext, stem: str, pictures: Mapping[str, NDArray[np.uint8]]) -> list[Path]:
    """Write files of which a stage returned the bytes, by the ends of their names."""
    assert run.output is not None
    files = [run.output / f"{stem}_{name}" for name in pictures]
    for file, content in zip(files, pictures.values(), strict=True):
        replace_file(file, content.tobytes())
    note_pictures(files)
    return files


def picture_modes(shapes: Shapes, stem: str, run: RunContext, film_of: int | None = None) -> list[tuple[Path, str]]:
    """Draw every mode, the von Mises stress of the first elastic one, and a film of one.

    Parameters
    ----------
    shapes
        The modes.
    stem
        Files are called ``stem_mode1.png`` and so on.
    run
        Output folder, store and progress.
    film_of
        Mode that moves in a GIF, counted from 0; None for the first elastic one.

    Returns
    -------
    Files and their captions.
    """
    # A body that nothing holds has up to six modes at zero, without strain.
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
    """Write pictures and a film, if they are wanted, and a VTU file that holds all modes.

    Parameters
    ----------
    shapes
        The modes.
    stem
        Stem of the files.
    film_of
        Mode that moves, counted from 1; None for the first elastic one.
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
