"""Checks that the joints share; each error names the joint."""

from dataclasses import fields

import numpy as np

from reduction.array_input import real_array, real_number
from reduction.errors import JointError


def lock_numbers(joint: object, *names: str) -> None:
    """Replace the rows of these names by read-only copies, and all scalars by floats.

    Raises
    ------
    JointError
        Entries that are no finite real numbers, a row of zeros, or one of another shape.
    """
    for name in names:
        row = real_array(getattr(joint, name), f"{label(joint)}: its {name}", JointError)
        object.__setattr__(joint, name, row)
        if name != "tangents" and row.ndim != 1:
            raise JointError(f"{label(joint)}: its {name} has shape {row.shape}, give one row of shape (r,)")
        if not np.isfinite(row).all() or not row.any():
            raise JointError(f"{label(joint)}: its {name} must hold finite numbers, not all of them zero")
    for field in fields(joint):  # type: ignore[arg-type]
        if field.type is float:
            what = f"{label(joint)}: {field.name}"
            value = real_number(getattr(joint, field.name), what, JointError)
            object.__setattr__(joint, field.name, value)
            if not np.isfinite(value):
                raise JointError(f"{what} = {value:g} must be a finite number")


def label(joint: object) -> str:
    """How messages call a joint."""
    return f'joint "{getattr(joint, "name", "")}"'
