"""What a codec reads back equals what it wrote."""

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from casefile.errors import Problem
from fe.system import LinearSystem
from hbsolve.limits.local_search import LimitSide
from pipeline.codec import JSON, NPZ, Codec
from reduction.rom import ReducedModel

SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
    | st.complex_numbers(allow_nan=False)
)  # fmt: skip
TREES = st.recursive(
    SCALARS,
    lambda tree: st.lists(tree) | st.lists(tree).map(tuple) | st.dictionaries(st.text() | st.integers(), tree),
    max_leaves=20,
)


@pytest.mark.parametrize("codec", [JSON, NPZ])
@settings(max_examples=60, deadline=None)
@given(tree=TREES)
def test_a_tree_of_plain_values_comes_back_equal(tmp_path_factory: Any, codec: Codec, tree: object) -> None:
    folder = tmp_path_factory.mktemp("entry")
    codec.save(tree, folder)
    back = codec.load(folder)
    assert back == tree
    assert repr(back) == repr(tree)  # 1 is not 1.0, a tuple is no list


@pytest.mark.parametrize("make", [sparse.csr_matrix, sparse.csc_matrix, sparse.csr_array])
def test_a_sparse_matrix_comes_back_as_rows(tmp_path: Path, make: Any) -> None:
    matrix = make(sparse.random(5, 4, 0.4, random_state=0))
    NPZ.save({"K": matrix}, tmp_path)
    back = NPZ.load(tmp_path)["K"]
    assert back.format == "csr"
    assert isinstance(back, sparse.sparray) == isinstance(matrix, sparse.sparray)
    np.testing.assert_array_equal(back.toarray(), matrix.toarray())


def test_what_travels_between_rooms_comes_back_field_by_field(tmp_path: Path) -> None:
    square = np.eye(3)
    model = ReducedModel(
        mass=square, damping=0 * square, stiffness=2 * square, boundary_node=np.array([7]),
        boundary_direction=np.array([1]), boundary_sets={"tip": np.array([0])},
        fixed_interface_frequency=np.array([1.0, 2.0]), recovery=np.ones((4, 3)), free=np.arange(4), n_node=2,
        provenance={"case": "mine"},
    )  # fmt: skip
    NPZ.save(model, tmp_path)
    back = NPZ.load(tmp_path)
    assert isinstance(back, ReducedModel)
    np.testing.assert_array_equal(back.recovery, model.recovery)
    np.testing.assert_array_equal(back.boundary_sets["tip"], [0])
    assert (back.n_node, back.provenance) == (2, {"case": "mine"})
    assert {field.name for field in fields(LinearSystem)} >= {"mass", "stiffness"}


@dataclass(frozen=True)
class Foreign:
    x: int


@pytest.mark.parametrize(
    ("codec", "value", "message"),
    [
        (JSON, np.zeros(2), r"numpy\.ndarray cannot be cached by this codec"),
        (NPZ, np.array([object()]), "elements are Python objects"),
        (NPZ, print, "builtin_function_or_method cannot be cached"),
        (NPZ, Foreign(3), "Foreign cannot be cached"),
    ],
)
def test_what_cannot_be_kept_faithfully_is_refused(tmp_path: Path, codec: Codec, value: object, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        codec.save(value, tmp_path)


def test_a_dataclass_of_the_product_is_rebuilt_and_a_foreign_name_is_refused(tmp_path: Path) -> None:
    problem = Problem(file="a.toml", line=3, key="x", text="no")
    JSON.save((problem, problem), tmp_path)
    assert JSON.load(tmp_path) == (problem, problem)
    for module, name in (("os", "system"), ("pipeline.codec", "JSON")):
        (tmp_path / "tree.json").write_text(json.dumps(["dataclass", module, name, {"command": "true"}]))
        with pytest.raises(ValueError, match=r"foreign module|no dataclass"):
            JSON.load(tmp_path)


def test_sets_and_enums_of_the_product_come_back_as_they_were(tmp_path: Path) -> None:
    value = {(3, LimitSide.LOWER), (4, LimitSide.UPPER)}, {(3, LimitSide.UPPER): (1.5, np.inf)}
    NPZ.save(value, tmp_path)
    back = NPZ.load(tmp_path)
    assert back == value
    # An integer would be equal to the side, and yet no side.
    assert all(isinstance(key[1], LimitSide) for part in back for key in part)
