"""Pictures, film and result file of mode shapes."""

from pathlib import Path

from study.figure.mode_picture import mode_animation, mode_picture
from study.progress import Progress
from study.shapes import Shapes

#: A film takes as long as so many pictures.
FILM_WORK = 8


def picture_modes(
    shapes: Shapes, folder: Path, stem: str, progress: Progress, film_of: int | None = None
) -> list[tuple[Path, str]]:
    """Draw every mode, the von Mises stress of the first elastic one, and a film of one.

    Parameters
    ----------
    shapes
        The modes.
    folder, stem
        Files are called ``stem_mode1.png`` and so on.
    progress
        Shows how many pictures are done.
    film_of
        Mode that moves in a GIF, counted from 0; None for the first elastic one.

    Returns
    -------
    Files and what each shows.
    """
    files: list[tuple[Path, str]] = []
    n_mode = len(shapes.frequency)
    # A body that nothing holds has up to six modes at zero, without strain.
    elastic = min(int((shapes.frequency == 0).sum()), n_mode - 1)
    moving = elastic if film_of is None else film_of
    with progress.step("pictures") as report:

        def words(number: int) -> tuple[float, str]:
            return float(shapes.frequency[number]), f"Mode {number + 1}"

        for number, displacement in enumerate(shapes.displacement):
            file = folder / f"{stem}_mode{number + 1}.png"
            frequency, title = words(number)
            mode_picture(shapes.mesh, displacement, file, frequency=frequency, title=title)
            files.append((file, f"{title}, displacement"))
            report(number + 1, n_mode + FILM_WORK)
        file = folder / f"{stem}_mode{elastic + 1}_stress.png"
        frequency, title = words(elastic)
        mode_picture(
            shapes.mesh,
            shapes.displacement[elastic],
            file,
            frequency=frequency,
            title=title,
            field="von_mises",
            values=shapes.von_mises[elastic],
        )
        files.append((file, f"{title}, von Mises stress"))
        film = folder / f"{stem}_mode{moving + 1}.gif"
        frequency, title = words(moving)
        mode_animation(shapes.mesh, shapes.displacement[moving], film, frequency=frequency, title=title)
        files.append((film, f"{title} over one period"))
    return files
