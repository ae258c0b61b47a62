"""PNG files of figures: rows of bytes as they are, which lines and letters on white paper suit best."""

import struct
import zlib

import numpy as np
from jaxtyping import UInt8
from numpy.typing import NDArray

#: Effort of the compression, of 9: half the time of the next one, for files larger by a twentieth.
COMPRESSION = 3
#: Bits of a colour, three colours, and the only ways of compression, filters and order that there are.
FORMAT = (8, 2, 0, 0, 0)
METRE = 1 / 0.0254


def encode_png(image: UInt8[NDArray[np.uint8], "height width 3"], dots_per_inch: float) -> bytes:
    """A PNG file of red, green and blue.

    Libraries try five filters on each row, which takes longer than the compression and makes files of figures larger.

    Parameters
    ----------
    image
        0 to 255, shape (height, width, 3).
    dots_per_inch
        Of the printed figure.

    References
    ----------
    Portable Network Graphics (PNG) Specification (Third Edition), W3C (2025), sections 5, 7, 9 and 11.
    """
    height, width, _ = image.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # the first byte says that a row has no filter
    rows[:, 1:] = image.reshape(height, 3 * width)
    density = round(dots_per_inch * METRE)
    chunks = {
        b"IHDR": struct.pack(">II5B", width, height, *FORMAT),
        b"pHYs": struct.pack(">IIB", density, density, 1),
        b"IDAT": zlib.compress(rows.data, COMPRESSION),
        b"IEND": b"",
    }
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*item) for item in chunks.items())


def _chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
