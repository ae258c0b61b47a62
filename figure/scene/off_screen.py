"""PyVista without a screen, imported only where it can draw.

VTK ends the whole process with a segmentation fault where it finds no way to draw, and no exception handler sees that.
So the way is asked for first, by `ctypes` alone.
"""

import ctypes
import os
from types import ModuleType

from geometry.errors import MissingSoftware
from geometry.system_library import require_system_libraries

WINDOW = "vtkEGLRenderWindow"
REMEDY = "apt-get update && apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri"


def require_egl() -> None:
    """Refuse to go on where no picture can be drawn.

    A loaded library is not enough: without a driver it offers no device, and VTK then falls back to OSMesa, which
    crashes if it is not there.

    Raises
    ------
    MissingSoftware
        With the line that installs what is missing.
    """
    require_system_libraries("pictures")
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError as error:
        raise MissingSoftware(f"off-screen pictures need libEGL.so.1: install it with `{REMEDY}`") from error
    if _count_devices(egl) == 0:
        raise MissingSoftware(
            f"off-screen pictures need a driver for EGL, and none was found: install it with `{REMEDY}`"
        )


def load_pyvista_off_screen() -> ModuleType:
    """PyVista, set to draw through EGL into memory.

    Raises
    ------
    MissingSoftware
        No picture can be drawn here.
    """
    require_egl()
    # VTK reads it when it opens its first window; anything else would look for a screen, or for OSMesa.
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = WINDOW
    import pyvista

    return pyvista


def _count_devices(egl: ctypes.CDLL) -> int:
    """Number of devices that EGL can draw with (extension EGL_EXT_device_enumeration); 1 if it cannot be asked."""
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return 1
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int))(address)
    count = ctypes.c_int(0)
    return count.value if query(0, None, ctypes.byref(count)) else 0
