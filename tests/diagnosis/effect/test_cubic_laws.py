"""Which laws are tried in place of that of a cubic spring."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.effect.cubic import Cubic, other_laws

ROW = np.array([1.0, 0.0])


def cubic(unit: str = "N/m^3") -> Cubic:
    parameter = EffectParameter(name="stiffness", unit=unit, lower=-1e9, upper=1e9, typical=1e6)
    return Cubic(name="cubic at tip", row=ROW, parameters=(parameter,))


def kinds(strength: float, *, largest: float = 1e-3, stiffness: Any = None, unit: str = "N/m^3") -> list[str]:
    model: Any = SimpleNamespace(
        system=SimpleNamespace(stiffness=np.eye(2) * 1e4 if stiffness is None else stiffness, joints=[])
    )
    state: Any = SimpleNamespace(amplitude=lambda row: largest * float(row[0]))
    return [
        law.kind + ("" if law.is_expected else ", perhaps") for law in other_laws(cubic(unit), strength, model, [state])
    ]


def test_what_hardens_may_be_a_clearance_and_all_may_be_an_even_law() -> None:
    assert kinds(1e6) == ["power law", *3 * ["clearance"], *2 * ["even law, perhaps"]]
    assert kinds(-1e6) == ["power law", *2 * ["even law"]]
    assert kinds(1e6, unit="N m") == ["power law", *3 * ["clearance"], *2 * ["even law, perhaps"]]


@pytest.mark.parametrize(("strength", "largest"), [(0.0, 1e-3), (1e6, 0.0)])
def test_without_strength_or_motion_no_law_is_tried(strength: float, largest: float) -> None:
    assert kinds(strength, largest=largest) == []


def test_where_a_force_moves_the_structure_without_end_no_even_law_is_tried() -> None:
    assert kinds(-1e6, stiffness=np.array([[1.0, -1.0], [-1.0, 1.0]])) == ["power law"]


def test_a_users_own_effect_of_that_kind_has_no_laws() -> None:
    own: Any = SimpleNamespace(name="cubic of mine", kind="cubic", parameters=())
    nothing: Any = None
    assert other_laws(own, 1.0, nothing, []) == []
