"""The case files that come with stickslip: their rows near the published ones, every tuned number named."""

import re
from pathlib import Path

import numpy as np
import pytest

from casefile.table import load_case
from fe.modal import modes
from study.kind.blade.model import clamped
from study.kind.registry import open_case
from study.shipped_cases import BEAM, BLADE, CASES, LIMITS, PAPER, RIG, SOLVE, TABLE1
from study.table1.case import Table1Case
from study.table1.study import make_row_inputs

BOTH = pytest.mark.parametrize("path", TABLE1, ids=lambda path: path.stem)
AIM = 0.3  # Hz
#: Model, element, elements through the thickness, root, frequency as published [Hz].
PUBLISHED = [
    (1, "hex8", 3, "full", 137.1),
    (2, "hex8", 3, "relaxed", 137.0),
    (3, "hex8", 4, "full", 131.1),
    (4, "hex8", 4, "relaxed", 131.0),
    (5, "hex20", 4, "full", 122.1),
    (6, "hex20", 5, "full", 122.1),
    (7, "hex20", 2, "full", 122.4),
    (8, "hex20", 2, "relaxed", 121.9),
    (9, "hex20", 1, "full", 122.6),
    (10, "hex20", 1, "relaxed", 122.1),
]


def test_every_shipped_file_is_used() -> None:
    assert {*TABLE1, BLADE, LIMITS, PAPER, RIG, SOLVE} == set(CASES.glob("*.toml"))


@pytest.mark.parametrize(
    ("path", "kind"), [(BLADE, "blade"), (RIG, "rig"), (SOLVE, "plain"), (LIMITS, "plain"), (BEAM, "plain")]
)
def test_every_shipped_case_is_one_of_its_kind(path: Path, kind: str) -> None:
    assert open_case(path).kind.name == kind


@BOTH
def test_the_rows_are_those_of_the_paper(path: Path) -> None:
    case = load_case(path, Table1Case)
    assert case.measured == 122.25
    rows = [(row.model, row.element, row.elements_through_thickness, row.root, row.paper) for row in case.model]
    assert rows == PUBLISHED


@BOTH
@pytest.mark.parametrize("model", [1, 2, 3, 9, 10])
def test_a_cheap_row_is_within_its_aim_and_its_second_mode_above_twice_the_first(path: Path, model: int) -> None:
    case = load_case(path, Table1Case)
    (asked,) = (row for row in case.model if row.model == model)
    _, system, _ = clamped(make_row_inputs(case, asked))
    first, second = modes(system, 2).frequency
    assert asked.paper is not None
    assert first == pytest.approx(asked.paper, abs=AIM)
    assert second > 2 * first


@BOTH
def test_tuned_numbers_are_keys_that_exist_and_that_the_file_sets(path: Path) -> None:
    case = load_case(path, Table1Case)
    tables = case.model_dump()
    assert len(set(case.tuned)) == len(case.tuned) > 0
    text = path.read_text(encoding="utf-8")
    for key in case.tuned:
        table, _, name = key.rpartition(".")
        value = tables
        for part in key.split("."):
            value = value[part]
        assert isinstance(value, int | float)
        # A default that nobody sees would not be a number of this file.
        (block,) = re.findall(rf"^\[{re.escape(table)}\]\n(.*?)(?=^\[|\Z)", text, re.MULTILINE | re.DOTALL)
        assert re.search(rf"^{name} = ", block, re.MULTILINE), key


def test_what_was_not_tuned_is_the_rig_in_every_file() -> None:
    rig, blade = load_case(TABLE1[0], Table1Case), open_case(BLADE).case.structure
    assert rig.blade == blade.blade
    assert rig.material == blade.material
    assert (rig.mesh.length_ratio, rig.mesh.length_cap, rig.mesh.pads) == (
        blade.mesh.length_ratio,
        blade.mesh.length_cap,
        blade.mesh.pads,
    )


@BOTH
def test_one_blade_one_mesh_rule_and_one_thinning_rule_make_all_rows(path: Path) -> None:
    case = load_case(path, Table1Case)
    models = [make_row_inputs(case, asked) for asked in case.model]
    for name in ("blade", "material", "length_ratio", "length_cap", "pads", "n_mode", "damping_ratio", "subdivisions"):
        assert len({getattr(model, name) for model in models}) == 1, name
    assert {model.drop_every for model in models} == {0, case.root.drop_every}
    # The cap must not decide where the 8-node rows lie: it is above a t / 3.
    thickness = case.blade.thickness
    assert case.mesh.length_cap > case.mesh.length_ratio * thickness / 3


@BOTH
def test_the_relaxed_clamp_of_every_mesh_is_the_full_one_with_the_same_share_free(path: Path) -> None:
    case = load_case(path, Table1Case)
    for asked in case.model:
        if asked.model in (2, 10):
            mesh, _, n_held_out = clamped(make_row_inputs(case, asked))
            vertices = np.intersect1d(mesh.nodes("clamp"), mesh.corner_nodes())
            assert n_held_out == len(vertices) - len(vertices) // case.root.drop_every
