"""PNG files are read by others as what was written."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from figure.png_file import encode_png


@pytest.mark.parametrize("shape", [(1, 1), (37, 300), (200, 3)])
def test_another_library_reads_what_was_written(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, size=(*shape, 3), dtype=np.uint8)
    with Image.open(BytesIO(encode_png(pixels, 160))) as image:
        image.load()
        assert (image.format, image.mode) == ("PNG", "RGB")
        np.testing.assert_array_equal(np.asarray(image), pixels)
        # Stored per metre, as a whole number: to half a dot in 6299.
        np.testing.assert_allclose(image.info["dpi"], 160, rtol=1e-4)


def test_a_view_of_transparent_pixels_is_written_without_their_transparency() -> None:
    pixels = np.random.default_rng(2).integers(0, 256, size=(20, 30, 4), dtype=np.uint8)
    with Image.open(BytesIO(encode_png(pixels[..., :3], 160))) as image:
        np.testing.assert_array_equal(np.asarray(image), pixels[..., :3])


def test_a_damaged_file_is_noticed() -> None:
    damaged = bytearray(encode_png(np.zeros((40, 40, 3), dtype=np.uint8), 160))
    damaged[-20] ^= 1
    with pytest.raises((OSError, SyntaxError)), Image.open(BytesIO(bytes(damaged))) as image:
        image.load()
