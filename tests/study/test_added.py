"""Added effects of a case: the model is complete with them, values keep their digits, mistakes have their lines."""

import re
from pathlib import Path

import numpy as np
import pytest

from casefile.errors import CaseError
from correlation.unnamed_place import list_unnamed_places
from diagnosis.candidate.effect import EffectError
from diagnosis.fit.added import AddedEffect
from study import cli
from study.beam.model import beam_model
from study.case.added import (
    apply_by_name,
    find_effect,
    format_parameter,
    list_case_effects,
    make_parameter_key,
    read_parameter,
)
from study.case.setup import read_case
from study.shipped_cases import BEAM
from study.solve.model import make_solve_model


def case_with(folder: Path, tables: str) -> Path:
    for name in ("beam.npz", "beam_finer.npz", "beam_finer.toml"):
        (folder / name).write_bytes(BEAM.with_name(name).read_bytes())
    case = folder / "case.toml"
    case.write_text(f"{BEAM.read_text(encoding='utf-8')}\n{tables}", encoding="utf-8")
    return case


def test_a_complete_model_has_its_effects_on_top_of_its_factors(tmp_path: Path) -> None:
    tables = '[[added]]\neffect = "mass at tip"\nmass = "93 mg"\n[calibrated]\nkt = 1.25\nE = "102 %"\n'
    setup = read_case(case_with(tmp_path, tables)).setup
    drawn, complete = setup.model, setup.complete
    tip = drawn.places["tip"]
    # 93 mg on one translation of one node; the digits of a sum with a mass of grams are lost, no more.
    np.testing.assert_allclose(complete.system.mass - drawn.system.mass, 93e-6 * np.outer(tip, tip), atol=1e-16)
    np.testing.assert_allclose(complete.system.stiffness, 1.02 * drawn.system.stiffness, rtol=1e-12)
    assert complete.contact("left.1").tangential_stiffness == pytest.approx(
        1.25 * drawn.contact("left.1").tangential_stiffness, rel=1e-14
    )
    assert setup.added[0].effect.name == "mass at tip"


def test_an_added_gap_runs_along_the_contacts_of_the_finer_model_too(tmp_path: Path) -> None:
    setup = read_case(case_with(tmp_path, '[[added]]\neffect = "gap of left at left.3"\ngap = "0.4 um"\n')).setup
    (finer,) = setup.complete_budget.refined
    gaps = [finer.contact(name).gap for name in finer.lines["left"]]
    # Linear, from none at one end: the nodes about a contact say nothing of where it is, their shapes are cubic.
    np.testing.assert_allclose(gaps, [0, 2e-7, 4e-7], rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(("end", "gaps"), [(1, [4, 3, 2, 1, 0]), (3, [0, 1, 2, 3, 4])])
def test_a_gap_towards_an_end_is_one_however_many_contacts_the_line_has(end: int, gaps: list[float]) -> None:
    effect = list_case_effects(beam_model(24), [], level=10.0).effect(f"gap of left at left.{end}")
    added = [AddedEffect(effect=effect, values=np.array([4e-7]))]
    finer = apply_by_name(beam_model(24, n_station=5), [], [], {}, added)
    result = [finer.contact(name).gap for name in finer.lines["left"]]
    np.testing.assert_allclose(result, 1e-7 * np.array(gaps), rtol=1e-12, atol=1e-18)


def test_a_case_without_effects_is_as_drawn() -> None:
    setup = read_case(BEAM).setup
    assert setup.added == ()
    assert setup.complete is setup.model


def test_every_value_is_read_as_it_was_written() -> None:
    for effect in list_case_effects(read_case(BEAM).setup.model, [], level=10.0).candidates:
        for parameter in effect.parameters:
            for value in (parameter.typical, 0.37 * parameter.typical + 0.63 * parameter.vanishes):
                # Six digits are written.
                assert read_parameter(format_parameter(value, parameter), parameter) == pytest.approx(value, rel=6e-6)
            assert re.fullmatch(r"[a-z_]+", make_parameter_key(parameter))


MISTAKES = [
    ('effect = "mas at tip"\nmass = "1 g"', 'effect = "mas at tip": there is no effect .* did you mean "mass at tip"'),
    ('effect = "mass at tip"\nmass = "1 mm"', 'mass = "1 mm": "mm" makes it a length, but a mass is needed, e.g. "'),
    ('effect = "mass at tip"\nmas = "1 g"', '"mas" is not a parameter of "mass at tip"; did you mean "mass"'),
    ('effect = "mass at tip"', '"mass at tip" has no value: add mass = "'),
    ('effect = "mass at tip"\nmass = "-3 kg"', 'mass = "-3 kg": is out of bounds: give a value from'),
    ('effect = "spring at mid"\nstiffness = 3', 'stiffness = 3: give a unit, e.g. "14.4 N/mm"'),
    ('mass = "1 g"', r'added\[0\].effect is missing; add effect = "mass at tip"'),
    (
        'effect = "mass at tip"\nmass = "1 g"\n[[added]]\neffect = "Mass at tip"\nmass = "1 g"',
        '"mass at tip" is added twice',
    ),
]


@pytest.mark.parametrize(("table", "message"), MISTAKES)
def test_a_mistake_in_an_added_effect_has_its_line(tmp_path: Path, table: str, message: str) -> None:
    case = case_with(tmp_path, f"[[added]]\n{table}\n")
    with pytest.raises(CaseError, match=message) as caught:
        read_case(case)
    (problem,) = caught.value.problems
    first = BEAM.read_text(encoding="utf-8").count("\n") + 2
    assert first <= problem.line <= first + 5


def test_a_factor_that_is_no_accepted_parameter_is_refused(tmp_path: Path) -> None:
    case = case_with(tmp_path, "[calibrated]\nmu = 1.1\n")
    case.write_text(case.read_text().replace('mu = "10 %"', "mu = 0"), encoding="utf-8")
    with pytest.raises(
        CaseError,
        match=r"calibrated.mu = 1.1: mu is in \[calibrated\], but is not a calibration parameter of this case: "
        "remove it",
    ):
        read_case(case)


#: Two masses, of which one rubs on a wall; small enough to be solved at once.
RUBBING = """\
schema = 2
title = "Two masses" # as drawn
[structure]
kind = "plain"
file = "chain.npz"
[[place]]
name = "tip"
dof = 1
[[sensor]]
name = "tip"
place = "tip"
[[load]]
place = "tip"
[[joint]]
kind = "jenkins"
name = "pad"
dof = 0
tangential_stiffness = "5 N/mm"
limit_force = "2 N"
[sweep]
from = "20 Hz"
to = "30 Hz"
"""


def test_every_command_sees_the_model_that_add_has_mended_and_undo_gives_the_earlier_bytes(at_home: Path) -> None:
    stiffness = np.array([[5e4, -2e4], [-2e4, 2e4]])
    dofs = {"dof_body": ["chain"] * 2, "dof_node": [0, 1], "dof_direction": ["z", "z"]}
    np.savez(at_home / "chain.npz", M=np.diag([1.0, 0.5]), C=2e-5 * stiffness, K=stiffness, **dofs)
    case = at_home / "chain.toml"
    case.write_text(RUBBING, encoding="utf-8")
    drawn = make_solve_model(read_case(case)).system
    assert drawn.mass[1, 1] == 0.5
    assert cli.main(["add", "mass at tip", "--value", "5 g", "--quiet"]) == 0
    read = read_case(case)
    corrected = make_solve_model(read)
    np.testing.assert_allclose(corrected.system.mass - drawn.mass, np.diag([0, 5e-3]), atol=1e-15)
    # What is drawn stays to be seen, and all else is the same.
    assert read.setup.model.system.mass[1, 1] == 0.5
    np.testing.assert_array_equal(corrected.system.stiffness, drawn.stiffness)
    case.write_text(case.read_text(encoding="utf-8") + "[calibrated]\nzeta = 1.2\n", encoding="utf-8")
    calibrated = make_solve_model(read_case(case)).system
    np.testing.assert_allclose(calibrated.damping, 1.2 * drawn.damping, rtol=1e-12)
    assert calibrated.mass[1, 1] == corrected.system.mass[1, 1]
    # An edit elsewhere survives the step back.
    assert cli.main(["undo", "--quiet"]) == 0
    left = case.read_text(encoding="utf-8").replace("[calibrated]\nzeta = 1.2\n", "")
    assert left.rstrip("\n") == RUBBING.rstrip("\n")
    case.write_text(RUBBING, encoding="utf-8")
    assert cli.main(["add", "spring at tip", "--value", "1 N/mm", "--quiet"]) == 0
    assert make_solve_model(read_case(case)).system.stiffness[1, 1] == pytest.approx(2.1e4, rel=1e-12)
    assert cli.main(["undo", "--quiet"]) == 0
    assert case.read_bytes() == RUBBING.encode()


@pytest.mark.parametrize("name", ["mass at node 6 z", " Mass at  Node 6 Z "])
def test_an_effect_may_act_where_no_place_is(name: str) -> None:
    model = beam_model(24)
    effect = find_effect(list_case_effects(model, [], [name]), name)
    assert effect.name == "mass at node 6 z"
    (number,) = np.flatnonzero(list_unnamed_places(model)["node 6 z"])
    heavier = effect.apply(model, [0.1]).system.mass - model.system.mass
    assert heavier[number, number] == pytest.approx(0.1)
    # Nodes of another mesh are other points.
    with pytest.raises(EffectError, match="there is no effect"):
        apply_by_name(beam_model(24, n_station=5), [], [], {}, [AddedEffect(effect=effect, values=np.array([0.1]))])
