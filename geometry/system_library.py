"""Check for the system's shared libraries that CAD and pictures need, before an import that could crash.

Without its system libraries, the import of CadQuery fails with an unclear message, and VTK ends the process with a
segmentation fault, which cannot be caught. The libraries are therefore checked with `ctypes` of the standard library.
"""

import ctypes
import os
from collections.abc import Sequence
from functools import cache
from typing import Literal

from geometry.errors import MissingSoftware

Purpose = Literal["cad", "pictures"]

# Shared libraries that the wheels load but do not contain; one library of each inner tuple suffices.
SYSTEM_LIBRARIES: dict[Purpose, tuple[tuple[str, ...], ...]] = {
    "cad": (("libGL.so.1",), ("libX11.so.6",), ("libexpat.so.1",), ("libstdc++.so.6",)),
    "pictures": (("libEGL.so.1", "libOSMesa.so.8"), ("libGL.so.1",), ("libX11.so.6",), ("libXrender.so.1",)),
}
DEBIAN_PACKAGE = {
    "libGL.so.1": "libgl1",
    "libX11.so.6": "libx11-6",
    "libexpat.so.1": "libexpat1",
    "libstdc++.so.6": "libstdc++6",
    "libEGL.so.1": "libegl1",
    "libXrender.so.1": "libxrender1",
}
MEANT_FOR = {"cad": "CAD geometry (cadquery)", "pictures": "off-screen pictures (pyvista)"}


def require_system_libraries(*purposes: Purpose) -> None:
    """Refuse to continue without a system library, before an import that could crash; it takes a millisecond.

    Parameters
    ----------
    purposes
        ``"cad"`` before CadQuery, ``"pictures"`` before PyVista or VTK.

    Raises
    ------
    MissingSoftware
        A library is missing; the message contains the command that installs it.
    """
    missing = {purpose: names for purpose in purposes if (names := missing_libraries(purpose))}
    if not missing:
        return
    what = "; ".join(f"{MEANT_FOR[purpose]} needs {', '.join(names)}" for purpose, names in missing.items())
    packages = sorted({DEBIAN_PACKAGE[name] for names in missing.values() for name in names})
    raise MissingSoftware(f"{what}: install with `{apt_line(packages)}`")


@cache
def missing_libraries(purpose: Purpose) -> tuple[str, ...]:
    """Shared libraries for a purpose that the loader does not find."""
    return tuple(names[0] for names in SYSTEM_LIBRARIES[purpose] if not any(loads(name) for name in names))


def apt_line(packages: Sequence[str]) -> str:
    """Shell command that installs Debian packages."""
    sudo = "" if os.geteuid() == 0 else "sudo "
    return f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {' '.join(packages)}"


def loads(name: str) -> bool:
    """Whether the loader finds a shared library."""
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True
