"""More memory than there is: blades, rigs and matrices are refused before it is taken, with both numbers."""

import numpy as np
import pytest
import scipy.sparse as sp

from fe.material import STEEL
from fe.system import LinearSystem
from geometry.rig import Rig
from reduction.errors import RomError
from study.kind.blade.model import make_blade_model, reduce_blade
from study.kind.registry import open_case
from study.kind.rig.model import RigModel
from study.kind.rig.reduction import list_reduction_tasks
from study.reduce.comparison import compare_reduction
from study.shipped_cases import BLADE


@pytest.fixture(autouse=True)
def little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearly no memory, and nothing that would take any."""
    monkeypatch.setattr("reduction.memory_estimate.read_available_memory", lambda: 1e3)
    monkeypatch.setattr("study.kind.blade.model.modes", None)
    monkeypatch.setattr("study.reduce.comparison.craig_bampton", None)


def test_a_blade_is_refused() -> None:
    case = open_case(BLADE).case
    model = make_blade_model(case, case.structure, "structure", element="hex8", through_thickness=1)
    with pytest.raises(RomError, match=r"reducing \d+ degrees of freedom to 48 and modes takes about .* GB are free"):
        reduce_blade(model)


def test_a_rig_is_refused_by_its_body() -> None:
    model = RigModel(rig=Rig(), material=STEEL, element="hex8", size=0.006, n_mode=10)
    with pytest.raises(RomError, match=r"reducing the blade of \d+ degrees of freedom takes about .* GB are free"):
        list_reduction_tasks(model, model.meshed())


def test_matrices_are_refused() -> None:
    unit = sp.csr_array(sp.eye_array(30))
    system = LinearSystem(mass=unit, damping=0 * unit, stiffness=unit, free=np.arange(30), n_node=10)
    with pytest.raises(RomError, match=r"reducing 30 degrees of freedom to 3 and 5 modes takes about .* GB are free"):
        compare_reduction(system, {"kept": np.arange(3)}, 5, None, {})
