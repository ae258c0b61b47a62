"""Read-only copies of arrays for frozen data classes."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray


def read_only(values: Any, kind: type = np.float64, order: Literal["K", "C"] = "K") -> NDArray[Any]:
    """Read-only copy of an array, converted to a type of numbers; "K" keeps the order in memory."""
    copy: NDArray[Any] = np.array(values, dtype=kind, order=order)
    copy.setflags(write=False)
    return copy


def freeze_fields(instance: Any, *names: str, kind: type = np.float64, order: Literal["K", "C"] = "K") -> None:
    """Replace array fields of a frozen dataclass by read-only copies."""
    for name in names:
        object.__setattr__(instance, name, read_only(getattr(instance, name), kind, order))
