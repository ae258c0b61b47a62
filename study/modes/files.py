"""Files of mode shapes: pictures and a film, kept like other results."""

from pathlib import Path

from pipeline.output import replace_file
from study.modes.pictures import mode_pictures
from study.modes.shapes import Shapes
from study.run_context import RunContext


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
    Files and what each shows.
    """
    assert run.output is not None
    # A body that nothing holds has up to six modes at zero, without strain.
    elastic = min(int((shapes.frequency == 0).sum()), len(shapes.frequency) - 1)
    moving = elastic if film_of is None else film_of
    step = run.step("pictures")
    drawn = step.run(mode_pictures, shapes, elastic, moving, step.report)
    shown = {
        **{f"mode{number + 1}.png": f"Mode {number + 1}, displacement" for number in range(len(shapes.frequency))},
        f"mode{elastic + 1}_stress.png": f"Mode {elastic + 1}, von Mises stress",
        f"mode{moving + 1}.gif": f"Mode {moving + 1} over one period",
    }
    files = []
    for name, caption in shown.items():
        file = run.output / f"{stem}_{name}"
        replace_file(file, drawn[name].tobytes())
        files.append((file, caption))
    return files
