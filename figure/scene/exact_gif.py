"""Films as GIF in which given colours stay what they are, however few pixels have them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from numpy.typing import NDArray
from scipy.spatial import KDTree

from figure.scene.film import Image, save_indexed

#: Of a GIF.
N_COLOUR = 256
#: Red, green and blue as one number.
WEIGHTS = np.array([1 << 16, 1 << 8, 1])


def save_exact_gif(frames: list[Image], file: Path, keep: Iterable[str]) -> None:
    """Write frames as a GIF that repeats for ever.

    Parameters
    ----------
    frames
        Of one size.
    file
        The file.
    keep
        Colours that are exact; the others are those nearest to the frames' own.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    from PIL import Image as Pillow

    palette = _palette(frames, keep)
    nearest = _nearest(frames, palette)
    pictures = [Pillow.fromarray(nearest[frame @ WEIGHTS]) for frame in frames]
    for picture in pictures:
        picture.putpalette(palette.ravel().tolist())
    save_indexed(pictures, file)


def _palette(frames: list[Image], keep: Iterable[str]) -> UInt8[NDArray[np.uint8], "colour 3"]:
    """One palette for all frames, from the two ends of the swing: palettes of their own would flicker."""
    from matplotlib.colors import to_rgb
    from PIL import Image as Pillow

    kept = np.array([to_rgb(colour) for colour in keep])
    ends = Pillow.fromarray(np.concatenate([frames[0], frames[len(frames) // 2]], axis=1))
    n_free = N_COLOUR - len(kept)
    # Means of clusters lie nearer to the colours of a colour map than the median cut alone.
    clusters = ends.quantize(n_free, kmeans=2, dither=Pillow.Dither.NONE)
    free = np.array(clusters.getpalette() or [], dtype=np.float64).reshape(-1, 3)
    return np.concatenate([np.rint(255 * kept), free[:n_free]]).astype(np.uint8)


def _nearest(frames: list[Image], palette: UInt8[NDArray[np.uint8], "colour 3"]) -> UInt8[NDArray[np.uint8], " rgb"]:
    """Number of the nearest colour of the palette for each colour of the frames: Pillow's own search is not exact."""
    found = np.zeros(1 << 24, dtype=np.bool_)
    for frame in frames:
        found[frame @ WEIGHTS] = True
    (there,) = np.nonzero(found)
    colours = there[:, None] // WEIGHTS % 256
    nearest = np.zeros(1 << 24, dtype=np.uint8)
    nearest[there] = KDTree(palette).query(colours)[1]
    return nearest
