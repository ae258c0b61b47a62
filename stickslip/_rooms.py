"""Whether Python finds our packages, or a user's of the same name."""

import importlib.util
from pathlib import Path

#: The packages beside this one.
ROOMS = (
    "geometry", "fe", "reduction", "hbsolve", "transient", "correlation", "diagnosis", "casefile", "pipeline", "figure",
    "study",
)  # fmt: skip


def require_own_rooms() -> None:
    """Refuse to start with a package of another's.

    Raises
    ------
    ImportError
        A folder or file hides one of ours.
    """
    ours = Path(__file__).resolve().parent.parent
    for room in ROOMS:
        spec = importlib.util.find_spec(room)
        if spec is None or spec.origin is None:
            raise ImportError(f"the package {room} of stickslip is not in {ours}: install stickslip again")
        found = Path(spec.origin).resolve()
        if not found.is_relative_to(ours / room):
            hiding = found.parent if found.name == "__init__.py" else found
            raise ImportError(
                f"{hiding} hides the package {room} of stickslip: rename it, or start elsewhere and without it on "
                "PYTHONPATH"
            )
