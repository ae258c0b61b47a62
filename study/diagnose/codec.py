"""How a step of a diagnosis is kept: pickled, since its effects may be anyone's, and read back with care.

A stored step may hold the product's own classes, arrays, and the classes of files with effects that this run has read;
a file that names anything else is not run, but taken for damaged.
"""

import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry.errors import InputError
from pipeline.code_dependencies import PRODUCT
from pipeline.codec import Codec

STEP_FILE = "step.pickle"
#: Functions and classes of others that pickles of arrays, numbers and paths are made of.
OTHERS = {
    ("numpy", "ndarray"), ("numpy", "dtype"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"), ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"), ("numpy._core.numeric", "_frombuffer"),
    ("numpy.core.numeric", "_frombuffer"), ("builtins", "complex"), ("builtins", "set"), ("builtins", "frozenset"),
    ("builtins", "slice"), ("builtins", "range"), ("pathlib", "Path"), ("pathlib", "PosixPath"),
    ("pathlib", "WindowsPath"), ("types", "MappingProxyType"), ("collections", "OrderedDict"),
}  # fmt: skip
#: The one function of the product that pickles name: it brings back an effect whose class stands in a file.
RESTORE = ("diagnosis.candidate.own_effect", "_restored")


@dataclass(frozen=True)
class _StepCodec:
    def save(self, value: Any, folder: Path) -> None:
        with (folder / STEP_FILE).open("wb") as stream:
            pickle.dump(value, stream, protocol=5)

    def load(self, folder: Path) -> Any:
        with (folder / STEP_FILE).open("rb") as stream:
            try:
                return _Careful(stream).load()
            except (pickle.UnpicklingError, EOFError, ImportError, InputError) as error:
                raise ValueError(f"a kept step cannot be read: {error}") from error


class _Careful(pickle.Unpickler):
    """Finds classes of the product, and what arrays are made of."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in OTHERS:
            return super().find_class(module, name)
        if (module, name) == RESTORE:
            return _restored
        if module.partition(".")[0] in PRODUCT:
            found: Any = super().find_class(module, name)
            if isinstance(found, type) and found.__module__.partition(".")[0] in PRODUCT:
                return found
        raise pickle.UnpicklingError(f"{module}.{name} has no place in a kept step")


def _restored(origin: str, pickled: bytes) -> Any:
    """An effect of a file or a package, with classes of its own module alone."""
    import io

    from diagnosis.candidate.own_effect import PREFIX, OwnEffect, read_effects

    if PREFIX.encode() in pickled:
        read_effects(origin)

    class Own(_Careful):
        def find_class(self, module: str, name: str) -> Any:
            loaded = sys.modules.get(module)
            found = getattr(loaded, name, None)
            if isinstance(found, type) and found.__module__ == module and "." not in name and _is_own(module):
                return found
            return super().find_class(module, name)

    return OwnEffect(effect=Own(io.BytesIO(pickled)).load(), origin=origin)


def _is_own(module: str) -> bool:
    """Whether a module is a file of effects that was read, or belongs to an installed package of effects."""
    if module.startswith("stickslip_effects_"):
        return True
    from importlib.metadata import entry_points

    packages = {point.value.partition(":")[0].partition(".")[0] for point in entry_points(group="stickslip.effects")}
    return module.partition(".")[0] in packages


STEP: Codec = _StepCodec()

Make = Callable[[], Any]
