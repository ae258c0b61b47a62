"""What the codec reads back equals what it wrote, and reading runs nothing that this process does not use anyway."""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from casefile.errors import Problem
from diagnosis.candidate.user_effect import read_effects
from diagnosis.threshold.detection_threshold import Thresholds
from fe.system import LinearSystem
from hbsolve.aft import InitialSliders
from hbsolve.limits.local_search import LimitSide
from pipeline.codec import decode, encode
from reduction.joint_law.friction_contact import Friction
from reduction.rom import ReducedModel
from study.case.setup import read_case
from study.shipped_cases import BEAM

OWN = Path(__file__).parents[2] / "examples" / "effects" / "exciter_third_harmonic.py"
SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
    | st.complex_numbers(allow_nan=False)
)  # fmt: skip
TREES = st.recursive(
    SCALARS,
    lambda tree: st.lists(tree) | st.lists(tree).map(tuple) | st.dictionaries(st.text() | st.integers(), tree),
    max_leaves=20,
)


def there_and_back(value: object) -> Any:
    tree, arrays = encode(value)
    return decode(json.loads(json.dumps(tree)), arrays.__getitem__)


@settings(max_examples=60, deadline=None)
@given(tree=TREES)
def test_a_tree_of_plain_values_comes_back_equal(tree: object) -> None:
    back = there_and_back(tree)
    assert back == tree
    assert repr(back) == repr(tree)  # 1 is not 1.0, a tuple is no list


@pytest.mark.parametrize("make", [sparse.csr_matrix, sparse.csc_matrix, sparse.csr_array])
def test_a_sparse_matrix_comes_back_as_rows(make: Any) -> None:
    matrix = make(sparse.random(5, 4, 0.4, random_state=0))
    back = there_and_back({"K": matrix})["K"]
    assert back.format == "csr"
    assert isinstance(back, sparse.sparray) == isinstance(matrix, sparse.sparray)
    np.testing.assert_array_equal(back.toarray(), matrix.toarray())


@pytest.mark.parametrize(
    "value",
    [
        Path("/a/b"), frozenset({1, (2, 3)}), range(1, 9, 2), slice(None, 4), MappingProxyType({"a": 1}),
        np.float64(0.1), np.int32(3), np.complex128(1 - 2j), np.str_("é"), np.bool_(True),
        InitialSliders(np.arange(3.0), np.arange(3)), Friction.COULOMB,
    ],
)  # fmt: skip
def test_other_values_come_back_as_what_they_were(value: Any) -> None:
    back = there_and_back([value])[0]
    assert type(back) is type(value)
    assert repr(back) == repr(value)


def test_what_stands_twice_is_written_once_and_is_one_object_again() -> None:
    array, shared = np.arange(4.0), [1.0]
    tree, arrays = encode({"a": array, "b": (array, shared), "c": shared})
    back = decode(tree, arrays.__getitem__)
    assert len(arrays) == 1
    assert back["a"] is back["b"][0]
    assert back["c"] is back["b"][1]


def test_what_travels_between_rooms_comes_back_field_by_field() -> None:
    square = np.eye(3)
    model = ReducedModel(
        mass=square, damping=0 * square, stiffness=2 * square, boundary_node=np.array([7]),
        boundary_direction=np.array([1]), boundary_sets={"tip": np.array([0])},
        fixed_interface_frequency=np.array([1.0, 2.0]), recovery=np.ones((4, 3)), free=np.arange(4), n_node=2,
        provenance={"case": "mine"},
    )  # fmt: skip
    back = there_and_back(model)
    assert isinstance(back, ReducedModel)
    np.testing.assert_array_equal(back.recovery, model.recovery)
    np.testing.assert_array_equal(back.boundary_sets["tip"], [0])
    assert (back.n_node, back.provenance) == (2, {"case": "mine"})
    assert {field.name for field in fields(LinearSystem)} >= {"mass", "stiffness"}


def test_models_and_thresholds_of_a_diagnosis_come_back() -> None:
    model = read_case(BEAM).setup.model
    limits = Thresholds(gain=1, misfit=2)
    back = there_and_back({"model": model, "limits": limits, "list": [1 + 2j, np.float64(3), {4}]})
    np.testing.assert_array_equal(back["model"].system.mass, model.system.mass)
    assert [type(item) for item in back["model"].system.joints] == [type(item) for item in model.system.joints]
    assert back["list"] == [1 + 2j, 3.0, {4}]
    assert back["limits"] == limits


@dataclass(frozen=True)
class Foreign:
    x: int


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.array([object()]), "elements are Python objects"),
        (print, "builtin_function_or_method cannot be stored"),
        (Foreign(3), "Foreign cannot be stored"),
        (sys, "module cannot be stored"),
        (lambda: 1, "function cannot be stored"),
    ],
)
def test_what_cannot_be_stored_faithfully_is_refused(value: object, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        encode(value)


def test_a_dataclass_of_the_product_is_rebuilt() -> None:
    problem = Problem(file="a.toml", line=3, key="x", text="no")
    assert there_and_back((problem, problem)) == (problem, problem)


@pytest.mark.parametrize("mark", ["dataclass", "enum", "object"])
@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("os", "system"), ("subprocess", "Popen"), ("pipeline.codec", "decode"), ("pipeline.output", "os.system"),
        ("pipeline.output", "Path"), ("correlation.campaign.read_campaign", "read_campaign"),
        ("stickslip_effects_of_nobody", "Effect"),
    ],
)  # fmt: skip
def test_a_tree_that_names_what_has_no_place_in_one_is_refused(mark: str, module: str, name: str) -> None:
    given: list[Any] = [{"command": "true"}] if mark == "dataclass" else [["tuple", "true"], None]
    with pytest.raises(ValueError, match=r"foreign module|not a class of that kind"):
        decode([mark, module, name, *given], {}.__getitem__)


def test_sets_and_enums_of_the_product_come_back_as_they_were() -> None:
    value = {(3, LimitSide.LOWER), (4, LimitSide.UPPER)}, {(3, LimitSide.UPPER): (1.5, np.inf)}
    back = there_and_back(value)
    assert back == value
    # An integer would be equal to the side, and yet no side.
    assert all(isinstance(key[1], LimitSide) for part in back for key in part)


EFFECTS = '''
"""Effects whose classes are no dataclasses."""
from diagnosis.candidate.effect import EffectParameter

class Louder:
    kind, physics, signature = "louder", "The exciter is stronger.", "All levels."
    def __init__(self, name):
        self.name, self.places = name, {"tip": (1, 2)}
        self.parameters = (EffectParameter(name="gain", unit="-", lower=0, upper=9, typical=1.1, vanishes=1.0),)
    def apply(self, model, values):
        return model

class Slotted(Louder):
    __slots__ = ("hidden",)
    def __init__(self):
        super().__init__("slotted")
        self.hidden = 3.5

class Closed(Louder):
    def __init__(self):
        super().__init__("closed")
        self.shape = __import__("math").sin

LISTED = [Louder("louder"), Slotted()]
'''


@pytest.fixture
def outside(tmp_path: Path) -> Mapping[str, Any]:
    """Names of a file with effects, as a case reads it."""
    file = tmp_path / "mine.py"
    file.write_text(EFFECTS + "def candidates(model): return LISTED\n")
    read_effects(file)
    (module,) = (item for item in sys.modules.values() if getattr(item, "__file__", "") == str(file))
    return vars(module)


def test_an_effect_of_a_users_file_comes_back(outside: Mapping[str, Any]) -> None:
    for effect in outside["LISTED"]:
        back = there_and_back(effect)
        assert type(back) is type(effect)
        assert vars(back) == vars(effect)
        assert getattr(back, "hidden", None) == getattr(effect, "hidden", None)
    (listed,) = read_effects(OWN).candidates(read_case(BEAM).setup.model)
    assert there_and_back(listed).name == listed.name


def test_a_users_file_that_this_process_has_not_read_is_not_run(outside: Mapping[str, Any]) -> None:
    tree, arrays = encode(outside["LISTED"][0])
    module = sys.modules.pop(outside["__name__"])
    try:
        with pytest.raises(ValueError, match="foreign module stickslip_effects_mine"):
            decode(tree, arrays.__getitem__)
    finally:
        sys.modules[outside["__name__"]] = module


def test_an_effect_with_a_function_among_its_values_is_refused(outside: Mapping[str, Any]) -> None:
    with pytest.raises(TypeError, match="cannot be stored"):
        encode(outside["Closed"]())
