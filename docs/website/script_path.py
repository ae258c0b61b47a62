"""`__file__` for the scripts of the gallery, which sphinx-gallery runs without it."""

import builtins
from typing import Any

NAME = "__file__"


def set_script_path(gallery_conf: dict[str, Any], script: str) -> None:
    """Let a script find files beside it; sphinx-gallery calls this before each."""
    del gallery_conf
    # A name that a script has not is looked up here.
    setattr(builtins, NAME, script)
