"""Pictures and film of mode shapes as a stage: drawing takes longer than reading what was drawn."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from figure.scene.mode_picture import mode_animation, mode_picture
from pipeline.store import stage
from study.modes.shapes import Shapes

#: A film takes as long as so many pictures.
FILM_WORK = 8


@stage("mode pictures", ignore=("report",))
def mode_pictures(
    shapes: Shapes, elastic: int, moving: int, report: Callable[[float, float], None]
) -> dict[str, NDArray[np.uint8]]:
    """Bytes of each picture file by name, such as ``mode1.png``."""
    n_mode = len(shapes.frequency)

    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        for number, displacement in enumerate(shapes.displacement):
            file = folder / f"mode{number + 1}.png"
            frequency = float(shapes.frequency[number])
            mode_picture(shapes.mesh, displacement, file, frequency=frequency, title=f"Mode {number + 1}")
            report(number + 1, n_mode + FILM_WORK)
        mode_picture(
            shapes.mesh,
            shapes.displacement[elastic],
            folder / f"mode{elastic + 1}_stress.png",
            frequency=float(shapes.frequency[elastic]),
            title=f"Mode {elastic + 1}",
            field="von_mises",
            values=shapes.von_mises[elastic],
        )
        mode_animation(
            shapes.mesh,
            shapes.displacement[moving],
            folder / f"mode{moving + 1}.gif",
            frequency=float(shapes.frequency[moving]),
            title=f"Mode {moving + 1}",
        )
        return {file.name: np.frombuffer(file.read_bytes(), dtype=np.uint8) for file in sorted(folder.iterdir())}
