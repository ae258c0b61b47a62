"""Whether Python finds our packages, or a user's of the same name."""

import importlib.util
from pathlib import Path

#: The packages beside this one.
PACKAGES = (
    "geometry", "fe", "reduction", "hbsolve", "transient", "correlation", "diagnosis", "casefile", "pipeline", "figure",
    "study",
)  # fmt: skip


def require_own_packages() -> None:
    """Refuse to start with a package of another's.

    Raises
    ------
    ImportError
        A folder or file hides one of ours.
    """
    ours = Path(__file__).resolve().parent.parent
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        if spec is None or spec.origin is None:
            raise ImportError(f"the package {package} of stickslip is not in {ours}: install stickslip again")
        module_file = Path(spec.origin).resolve()
        if not module_file.is_relative_to(ours / package):
            hiding = module_file.parent if module_file.name == "__init__.py" else module_file
            raise ImportError(
                f"{hiding} hides the package {package} of stickslip: rename it, or start elsewhere and without it on "
                "PYTHONPATH"
            )
