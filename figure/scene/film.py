"""Pictures and films as files: PNG and GIF by Pillow, MP4 where imageio-ffmpeg is installed."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from numpy.typing import NDArray
from scipy.spatial import KDTree

from geometry.errors import InputError, MissingSoftware, OutputError

#: Red, green and blue, shape (height, width, 3).
Image = NDArray[np.uint8]
#: A picture within another, and where: left and top [pixels].
Part = tuple[int, int, Image]

#: Frames per second.
RATE = 20
#: An MP4 shows its period this often, since few players repeat a film.
REPEATS = 3
#: Colours of a GIF above it in red, green and blue are made white, out of 255.
ALMOST_WHITE = 245
#: Of a GIF.
N_COLOUR = 256
#: Red, green and blue as one number.
WEIGHTS = np.array([1 << 16, 1 << 8, 1])


def check_suffix(path: str | PathLike[str], suffixes: Sequence[str]) -> Path:
    """Path; refuse another suffix than the given ones.

    Raises
    ------
    InputError
        Another suffix.
    """
    file = Path(path)
    if file.suffix.lower() not in suffixes:
        raise InputError(f'{file} has the suffix "{file.suffix}": use {" or ".join(suffixes)}')
    return file


def paste(canvas: Image, parts: Iterable[Part]) -> Image:
    """A copy of a picture with others in it."""
    picture = canvas.copy()
    for left, top, part in parts:
        picture[top : top + part.shape[0], left : left + part.shape[1]] = part
    return picture


def save_picture(picture: Image, file: Path) -> None:
    """Write a PNG.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with _writing(file):
        _convert_to_pillow(picture).save(file)


def save_gif(frames: list[Image], file: Path) -> None:
    """Write frames as a GIF that repeats for ever.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    # One palette for all frames, from the two ends of the swing: palettes of their own would flicker.
    ends = [frames[0], frames[len(frames) // 2]]
    palette = _convert_to_pillow(np.concatenate(ends, axis=1)).quantize(256, dither=0)
    colours = np.reshape(palette.getpalette(), (-1, 3))
    # The palette averages its colours: without this the paper would be pale grey.
    colours[colours.min(axis=1) > ALMOST_WHITE] = 255
    palette.putpalette(colours.ravel().tolist())
    save_indexed([_convert_to_pillow(frame).quantize(palette=palette, dither=0) for frame in frames], file)


def save_exact_gif(frames: list[Image], file: Path, keep: Iterable[str]) -> None:
    """Write frames as a GIF that repeats for ever, in which some colours stay exact, however few pixels have them.

    Parameters
    ----------
    frames
        Frames of one size.
    file
        The file.
    keep
        Colours that are exact; the others are those nearest to the frames' own.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    palette = _choose_palette(frames, keep)
    nearest = _find_nearest(frames, palette)
    pictures = [_convert_to_pillow(nearest[frame @ WEIGHTS]) for frame in frames]
    for picture in pictures:
        picture.putpalette(palette.ravel().tolist())
    save_indexed(pictures, file)


def save_indexed(pictures: Sequence[Any], file: Path) -> None:
    """Write Pillow's pictures, which have one palette, as a GIF that repeats for ever.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    first, *rest = pictures
    look = {"duration": 1000 // RATE, "loop": 0, "optimize": False, "disposal": 1}
    with _writing(file):
        first.save(file, save_all=True, append_images=rest, **look)


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
    OutputError
        It cannot be written.
    """
    # Films want even numbers of pixels: a last odd row or column is left out.
    height, width = (n - n % 2 for n in frames[0].shape[:2])
    writer = require_film_writer()
    with _writing(file):
        film = writer.write_frames(str(file), (width, height), fps=RATE, quality=8, macro_block_size=2)
        film.send(None)
        for frame in frames * REPEATS:
            film.send(np.ascontiguousarray(frame[:height, :width]))
        film.close()


@contextmanager
def _writing(file: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(f"{file} cannot be written ({error.strerror}): choose a folder that exists") from error


def _convert_to_pillow(picture: Image) -> Any:
    from PIL import Image as Pillow

    return Pillow.fromarray(picture)


def _choose_palette(frames: list[Image], keep: Iterable[str]) -> UInt8[NDArray[np.uint8], "colour 3"]:
    """One palette for all frames, from the two ends of the swing: palettes of their own would flicker."""
    from matplotlib.colors import to_rgb
    from PIL import Image as Pillow

    exact = np.array([to_rgb(colour) for colour in keep])
    ends = _convert_to_pillow(np.concatenate([frames[0], frames[len(frames) // 2]], axis=1))
    n_free = N_COLOUR - len(exact)
    # Means of clusters lie nearer to the colours of a colour map than the median cut alone.
    clusters = ends.quantize(n_free, kmeans=2, dither=Pillow.Dither.NONE)
    free = np.array(clusters.getpalette() or [], dtype=np.float64).reshape(-1, 3)
    return np.concatenate([np.rint(255 * exact), free[:n_free]]).astype(np.uint8)


def _find_nearest(
    frames: list[Image], palette: UInt8[NDArray[np.uint8], "colour 3"]
) -> UInt8[NDArray[np.uint8], " rgb"]:
    """Number of the nearest colour of the palette for each colour of the frames: Pillow's own search is not exact."""
    result = np.zeros(1 << 24, dtype=np.bool_)
    for frame in frames:
        result[frame @ WEIGHTS] = True
    (there,) = np.nonzero(result)
    colours = there[:, None] // WEIGHTS % 256
    nearest = np.zeros(1 << 24, dtype=np.uint8)
    nearest[there] = KDTree(palette).query(colours)[1]
    return nearest
