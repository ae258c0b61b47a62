"""Default folder of stored results."""

import os
from pathlib import Path


def default_folder() -> Path:
    """Cache folder of this user: ``STICKSLIP_CACHE`` if it is set, else where the system keeps caches."""
    named = os.environ.get("STICKSLIP_CACHE")
    if named:
        return Path(named).expanduser()
    from platformdirs import user_cache_path

    return user_cache_path("stickslip", appauthor=False)
