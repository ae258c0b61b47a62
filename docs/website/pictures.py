"""Pictures that an example wrote, for sphinx-gallery."""

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


def written_pictures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Take the PNG files that a block of an example has written, as RST that shows them."""
    del block
    folder = Path(block_vars["src_file"]).parent
    taken = []
    for picture, target in zip(sorted(folder.glob("*.png")), block_vars["image_path_iterator"], strict=False):
        shutil.move(picture, target)
        taken.append(target)
    return figure_rst(taken, gallery_conf["src_dir"])
