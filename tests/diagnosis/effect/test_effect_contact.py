"""What effects of one contact line against the others do."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.errors import ModelDefinitionError
from correlation.model import DeadWeight, Dof, Model
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.contact_line import find_contacts
from diagnosis.effect.gap import Gap
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import FrictionContact
from reduction.stuck import stuck_stiffness
from study.beam.model import beam_model


def applied(model: Model, name: str, value: float) -> Model:
    return list_effects(model).effect(name).apply(model, [value])


def values(model: Model, line: str, quantity: str) -> np.ndarray:
    return np.array([getattr(contact, quantity) for contact in find_contacts(model, line)])


def reasons(model: Model) -> dict[str, str]:
    return {item.name: item.reason for item in list_effects(model).untestable}


def with_lines(model: Model, *names: str) -> Model:
    """Lines of two contacts each instead, of the contacts of the bench in turn."""
    joints = [joint.name for joint in model.system.joints]
    lines = {name: (joints[2 * number], joints[2 * number + 1]) for number, name in enumerate(names)}
    return replace(model, lines=lines, sensors=())


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [("friction coefficient", "friction_coefficient"), ("tangential stiffness", "tangential_stiffness")],
)
def test_two_lines_have_one_ratio_between_them(bench: Model, kind: str, quantity: str) -> None:
    assert [item for item in list_effects(bench).names if item.startswith(kind)] == [f"{kind} of left against right"]
    changed = applied(bench, f"{kind} of left against right", 1.44)
    np.testing.assert_allclose(values(changed, "left", quantity), 1.2 * values(bench, "left", quantity))
    np.testing.assert_allclose(values(changed, "right", quantity), values(bench, "right", quantity) / 1.2)


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [("friction coefficient", "friction_coefficient"), ("tangential stiffness", "tangential_stiffness")],
)
def test_of_three_lines_each_has_its_own(bench: Model, kind: str, quantity: str) -> None:
    three = with_lines(bench, "a", "b", "c")
    assert [item for item in list_effects(three).names if item.startswith(kind)] == [f"{kind} of {x}" for x in "abc"]
    changed = applied(three, f"{kind} of b", 1.44)
    for line, factor in {"a": 1.0, "b": 1.44, "c": 1.0}.items():
        np.testing.assert_allclose(values(changed, line, quantity), factor * values(three, line, quantity))


def test_a_single_line_has_no_other(bench: Model) -> None:
    left = reasons(with_lines(bench, "a"))
    assert left["friction coefficient of a"] == (
        "the model has only one contact line: its friction coefficient is calibrated"
    )
    assert "preload of a" in list_effects(with_lines(bench, "a")).names


def test_without_lines_nothing_of_them_can_be_tested(bench: Model) -> None:
    left = reasons(bench.without_contacts())
    for kind in ("friction coefficient", "tangential stiffness", "preload", "gap"):
        assert left[kind] == "the model has no contact lines"


@pytest.mark.parametrize("ratio", [0.1, 0.7, 1.0, 2.5])
def test_rest_stays_rest_at_any_preload(bench: Model, ratio: float) -> None:
    changed = applied(bench, "preload of right", ratio)
    np.testing.assert_allclose(values(changed, "right", "preload"), ratio * values(bench, "right", "preload"))
    np.testing.assert_array_equal(values(changed, "left", "preload"), values(bench, "left", "preload"))
    # All loads at rest: the static load and the contacts pushing back.
    pushed = sum(joint.preload * joint.normal for joint in changed.system.joints)
    np.testing.assert_allclose(changed.system.static, pushed, atol=1e-14)
    level = 1e-3  # N; far from slip, so that the mean is that of rest
    state = steady_state(HarmonicBalance(system=changed.system, n_harmonic=3, level=level), 60.0)
    assert abs(state.coefficients[0]).max() < 1e-9 * abs(state.coefficients[1]).max()


def weighted(model: Model) -> Model:
    """One weight presses both lines, through the masses beside them."""
    row = np.zeros(model.system.n_dof)
    row[[1, 3]] = 2.0, 3.0
    return replace(model, dead_weights={"weight": DeadWeight(row=row, lines=("left", "right"))})


def test_lines_under_a_dead_weight_are_pressed_by_it_alone(bench: Model) -> None:
    names = [item for item in list_effects(weighted(bench)).names if item.startswith("preload")]
    assert names == ["preload by weight"]
    only_left = replace(weighted(bench), dead_weights={"weight": DeadWeight(row=np.ones(7), lines=("left",))})
    assert only_left.preloads == ("weight", "right")
    assert weighted(bench).without_contacts().preloads == ()


@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_a_dead_weight_presses_as_stiffness_shares_it(bench: Model, ratio: float) -> None:
    model = weighted(bench)
    changed = applied(model, "preload by weight", ratio)
    state = steady_state(HarmonicBalance(system=changed.system, n_harmonic=3, level=1e-6), 60.0)
    # All contacts stay closed and stuck: the linear structure with their springs.
    stuck = stuck_stiffness(model.system.stiffness, model.system.joints)
    moved = np.linalg.solve(stuck, (ratio - 1) * model.dead_weights["weight"].row)
    np.testing.assert_allclose(state.coefficients[0].real, moved, rtol=1e-8, atol=1e-8 * np.abs(moved).max())


@pytest.mark.parametrize("kind", ["line", "weight"])
def test_pressing_twice_multiplies(bench: Model, kind: str) -> None:
    model, name = (bench, "left") if kind == "line" else (weighted(bench), "weight")
    twice, once = model.with_preload_ratio(name, 0.5).with_preload_ratio(name, 0.8), model.with_preload_ratio(name, 0.4)
    np.testing.assert_allclose(twice.system.static, once.system.static, rtol=1e-12)
    for model in (twice, once):
        static, preloads = model.preload_slope(name)
        expected, at_first = (bench if kind == "line" else weighted(bench)).preload_slope(name)
        np.testing.assert_allclose(static, 0.4 * expected, rtol=1e-12)
        assert preloads == pytest.approx({item: 0.4 * value for item, value in at_first.items()})


def test_what_presses_nothing_is_refused(bench: Model) -> None:
    with pytest.raises(ModelDefinitionError, match='"typo" is not a preload of the model: there are left, right'):
        bench.with_preload_ratio("typo", 0.1)
    with pytest.raises(ModelDefinitionError, match='"left" is not a preload of the model: there are weight'):
        weighted(bench).with_preload_ratio("left", 0.5)
    with pytest.raises(ModelDefinitionError, match='dead weight "none" is zero'):
        replace(bench, dead_weights={"none": DeadWeight(row=np.zeros(7), lines=("left",))})


def test_a_gap_is_linear_along_its_line(bench: Model) -> None:
    # The stations sit at 0.1, 0.3 and 0.9 between two nodes: a quarter of the way, not a half.
    changed = applied(bench, "gap of left at left 2", 4e-5)
    np.testing.assert_allclose(values(changed, "left", "gap"), [0, 1e-5, 4e-5], atol=1e-18)
    again = list_effects(changed).effect("gap of left at left 0").apply(changed, [4e-5])
    np.testing.assert_allclose(values(again, "left", "gap"), [4e-5, 4e-5, 4e-5])
    assert not values(again, "right", "gap").any()
    np.testing.assert_array_equal(again.system.static, bench.system.static)


@pytest.mark.parametrize("dof", [Dof(), Dof(direction="z"), Dof(direction="ry", coordinates=np.array([0.3, 0, 0]))])
def test_a_gap_along_contacts_of_unknown_coordinates_is_shared_evenly(bench: Model, dof: Dof) -> None:
    unknown = replace(bench, dofs=(dof,) * 7)
    np.testing.assert_allclose(
        values(applied(unknown, "gap of left at left 2", 1e-5), "left", "gap"), [0, 5e-6, 1e-5], atol=1e-18
    )


def test_a_contact_at_a_node_that_turns_is_where_the_node_is() -> None:
    model = beam_model(30)  # with nodes at the contacts, at 0.20, 0.21 and 0.22 m
    moved = [
        replace(dof, coordinates=np.array([0.205, 0, 0])) if dof.coordinates is not None and dof.node == 21 else dof
        for dof in model.dofs
    ]
    changed = applied(replace(model, dofs=tuple(moved)), "gap of left at left.3", 4e-6)
    np.testing.assert_allclose(values(changed, "left", "gap"), [0, 1e-6, 4e-6], rtol=1e-9, atol=1e-18)


def test_a_gap_lowers_the_mean_normal_force(bench: Model) -> None:
    def stretch(model: Model) -> float:
        state = steady_state(HarmonicBalance(system=model.system, n_harmonic=3, level=1e-3), 60.0)
        left = find_contacts(model, "left")
        normal = sum(
            joint.preload + joint.normal_stiffness * (joint.normal @ state.coefficients[0].real - joint.gap)
            for joint in left
        )
        return float(normal)

    effect = list_effects(bench).effect("gap of left at left 2")
    assert stretch(bench) == pytest.approx(8.0, rel=1e-6)
    assert stretch(effect.apply(bench, [effect.parameters[0].typical])) < 7.9


def test_gaps_are_typically_a_quarter_of_what_the_preload_closes(bench: Model) -> None:
    parameter = list_effects(bench).effect("gap of right at right 0").parameters[0]
    assert parameter.typical == pytest.approx(8.0 / 4e4 / 4)
    loose = bench.with_joints({f"left {number}": {"preload": 0.0} for number in range(3)})
    normal = find_contacts(loose, "left")[2].normal
    assert 0 < list_effects(loose).effect("gap of left at left 0").parameters[0].typical < abs(normal).max()
    assert reasons(loose)["preload of left"] == "it is zero in the model, and a ratio cannot change zero"
    still = loose.with_system(harmonic_force=None)
    assert "never close" in reasons(still)["gap of left"]


def test_a_line_of_one_contact_has_one_gap_and_an_empty_one_none(bench: Model) -> None:
    model = replace(bench, lines={"point": ("left 1",), "none": ()}, sensors=())
    effect = list_effects(model).effect("gap of point")
    assert isinstance(effect, Gap)
    gaps = [joint.gap for joint in effect.apply(model, [1e-5]).system.joints if isinstance(joint, FrictionContact)]
    assert gaps == [0, 1e-5, 0, 0, 0, 0]
    assert reasons(model)["gap of none"] == "the line has no contacts"
