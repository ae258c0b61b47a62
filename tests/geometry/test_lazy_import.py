"""CAD takes seconds to import; whoever needs only dimensions must not wait for it."""

import subprocess
import sys

import pytest

HEAVY = {"cadquery", "OCP", "vtkmodules", "pyvista", "matplotlib", "meshio", "pint", "numba", "scipy"}


@pytest.mark.parametrize(
    "module", ["blade", "plain_blade", "part", "interface", "step_io", "solid", "blade_solid", "damper"]
)
def test_importing_a_module_imports_nothing_heavy(module: str) -> None:
    script = f"import sys, geometry.{module}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not HEAVY & set(done.stdout.split())


def test_dimensions_and_contact_lines_need_no_cad() -> None:
    script = (
        "import sys; from geometry.blade import Blade, contact_lines, named_points; "
        "contact_lines(Blade()); named_points(Blade()); print('cadquery' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
