"""Pictures and films as files: PNG and GIF by Pillow, MP4 where imageio-ffmpeg is installed."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from study.errors import MissingSoftware

#: Red, green and blue, shape (height, width, 3).
Image = NDArray[np.uint8]

#: Frames a second.
RATE = 20
#: An MP4 shows its period this often, since few players repeat a film.
REPEATS = 3
#: Colours of a GIF above it in red, green and blue are made white, out of 255.
ALMOST_WHITE = 245


def save_picture(picture: Image, file: Path) -> None:
    """Write a PNG."""
    _pillow(picture).save(file)


def save_gif(frames: list[Image], file: Path) -> None:
    """Write frames as a GIF that repeats for ever."""
    # One palette for all frames, from the two ends of the swing: palettes of their own would flicker.
    ends = [frames[0], frames[len(frames) // 2]]
    palette = _pillow(np.concatenate(ends, axis=1)).quantize(256, dither=0)
    colours = np.reshape(palette.getpalette(), (-1, 3))
    # The palette averages its colours: without this the paper would be pale grey.
    colours[colours.min(axis=1) > ALMOST_WHITE] = 255
    palette.putpalette(colours.ravel().tolist())
    first, *rest = (_pillow(frame).quantize(palette=palette, dither=0) for frame in frames)
    first.save(file, save_all=True, append_images=rest, duration=1000 // RATE, loop=0, optimize=False, disposal=1)


def require_film_writer() -> Any:
    """The package that encodes an MP4.

    Raises
    ------
    MissingSoftware
        It is not installed.
    """
    try:
        # By name: it is no dependency, so that type checkers need not find it.
        return import_module("imageio_ffmpeg")
    except ImportError as error:
        raise MissingSoftware(
            "an MP4 film needs the package imageio-ffmpeg: `pip install imageio-ffmpeg`, or write a .gif"
        ) from error


def save_film(frames: list[Image], file: Path) -> None:
    """Write frames as an MP4, `REPEATS` times over.

    Raises
    ------
    MissingSoftware
        The package imageio-ffmpeg is not installed.
    """
    # Films want even numbers of pixels: a last odd row or column is left out.
    height, width = (n - n % 2 for n in frames[0].shape[:2])
    film = require_film_writer().write_frames(str(file), (width, height), fps=RATE, quality=8, macro_block_size=2)
    film.send(None)
    for frame in frames * REPEATS:
        film.send(np.ascontiguousarray(frame[:height, :width]))
    film.close()


def _pillow(picture: Image) -> Any:
    from PIL import Image as Pillow

    return Pillow.fromarray(picture)
