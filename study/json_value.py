"""Values of Python and NumPy as strict JSON."""

import math
from collections.abc import Mapping
from typing import Any


def to_json(value: Any) -> Any:
    """Convert a value to strict JSON: arrays become lists, numbers that are not finite become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        # A fast path: a page has a hundred thousand numbers in lists of floats.
        if all(type(item) is float for item in value) and all(map(math.isfinite, value)):
            return list(value)
        return [to_json(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's arrays and numbers
        return to_json(value.tolist())
    return str(value)
