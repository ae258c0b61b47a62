"""Rest of bodies on contacts that may open, against every set of open and closed contacts that could be."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from reduction.errors import JointError
from reduction.jointed_system import Friction, FrictionContact
from reduction.static_contact import StaticState, static_state

Array = NDArray[np.float64]
#: A tangential stiffness that counts for nothing beside normal ones of 1e6 N/m: contacts without friction.
NOTHING = 1e-9
NO_REST = "there is no equilibrium under the static load: the contacts that stay closed leave a body free"


def contact(
    name: str, normal: Array, tangents: Array, *, k_n: float = 1e6, k_t: float = 5e5, mu: float = 0.5, gap: float = 0.0
) -> FrictionContact:
    return FrictionContact(
        name=name, normal=normal, tangents=tangents, normal_stiffness=k_n, tangential_stiffness=k_t,
        friction_coefficient=mu, gap=gap,
    )  # fmt: skip


def every_rest(stiffness: Array, contacts: list[FrictionContact], load: Array) -> list[tuple[tuple[bool, ...], Array]]:
    """All sets of closed contacts whose displacement closes them and opens the others."""
    result = []
    for closed in product([False, True], repeat=len(contacts)):
        matrix, force = stiffness.copy(), load.copy()
        for item, on in zip(contacts, closed, strict=True):
            if on:
                matrix += item.normal_stiffness * np.outer(item.normal, item.normal)
                matrix += item.tangential_stiffness * item.tangents.T @ item.tangents
                force += item.normal_stiffness * item.gap * item.normal
        if np.linalg.cond(matrix) > 1e13:
            continue
        q: Array = np.asarray(np.linalg.solve(matrix, force), dtype=np.float64)
        if all((float(item.normal @ q) > item.gap) == on for item, on in zip(contacts, closed, strict=True)):
            result.append((closed, q))
    return result


def check_balance(stiffness: Array, contacts: list[FrictionContact], load: Array, rest: StaticState) -> None:
    """Elastic and contact forces make up the load; pressed contacts push."""
    held = sum(
        (
            N * item.normal + T @ item.tangents
            for item, N, T in zip(contacts, rest.normal, rest.tangential, strict=True)
        ),
        start=np.zeros(len(load)),
    )
    scale = np.abs(load).max()
    np.testing.assert_allclose(stiffness @ rest.displacement + held, load, atol=1e-10 * scale)
    np.testing.assert_allclose(rest.load, held, atol=1e-10 * scale)
    assert (rest.normal >= 0).all()


def block(places: Array, height: float = 1.0, gaps: Array | None = None, k_t: float = 5e5) -> list[FrictionContact]:
    """A rigid block in its plane, coordinates x, z and rotation about its centre, on springs below it at some x."""
    opening = np.zeros(len(places)) if gaps is None else gaps
    return [
        contact(f"foot.{i + 1}", np.array([0.0, -1.0, a]), np.array([[1.0, 0.0, -height]]), gap=float(g), k_t=k_t)
        for i, (a, g) in enumerate(zip(places, opening, strict=True))
    ]


def pressed_at(place: float, force: float, push: float = 0.0, height: float = 1.0) -> Array:
    """Load on the block: down at some x, and along x in the plane of the springs."""
    return np.array([push, -force, place * force - height * push])


@pytest.mark.parametrize(("force", "gap"), [(30.0, 0.0), (30.0, 2e-5), (30.0, -2e-5), (3.0, 2e-5), (-3.0, 0.0)])
def test_a_mass_on_a_spring_meets_another_one_across_a_gap(force: float, gap: float) -> None:
    k, k_n = 4e5, 1e6
    contacts = [contact("stop", np.array([1.0]), np.array([[1.0]]), k_n=k_n, k_t=NOTHING, gap=gap)]
    rest = static_state(np.array([[k]]), contacts, np.array([force]))
    meets = force > k * gap
    q = (force + k_n * gap) / (k + k_n) if meets else force / k
    # The tangential spring is 1e-15 of the others.
    np.testing.assert_allclose(rest.displacement, [q], rtol=1e-13)
    np.testing.assert_allclose(rest.normal, [k_n * (q - gap) if meets else 0.0], rtol=1e-12)
    np.testing.assert_allclose(rest.load, [force - k * q], atol=1e-12)
    assert rest.contacts[0].preload == rest.normal[0]
    np.testing.assert_allclose(rest.contacts[0].gap, 0.0 if meets else gap - q, rtol=1e-12)


# On the softer ones, sets of closed contacts come again when all of them change at once.
@pytest.mark.parametrize(
    ("share", "seed"), [*((1.0, n) for n in range(40)), *((0.01, n) for n in (8, 52, 57, 68, 186))]
)
def test_without_friction_it_is_the_one_rest_that_there_is(share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((4, 4))
    stiffness, load = share * 1e6 * root @ root.T, 10 * rng.standard_normal(4)
    contacts = [
        contact(f"c.{i}", rng.standard_normal(4), np.eye(4)[:1], k_n=1e6 * 10 ** rng.uniform(-1, 1), k_t=NOTHING,
                gap=1e-5 * rng.uniform(-0.5, 1))
        for i in range(6)
    ]  # fmt: skip
    ((closed, q),) = every_rest(stiffness, contacts, load)
    rest = static_state(stiffness, contacts, load)
    np.testing.assert_allclose(rest.displacement, q, atol=1e-9 * np.abs(q).max())
    assert tuple(rest.normal > 0) == closed
    check_balance(stiffness, contacts, load, rest)


@pytest.mark.parametrize("seed", range(30))
def test_what_touches_without_a_force_does_not_open_and_close_for_ever(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root, (pressed, touched) = rng.standard_normal((3, 3)), rng.standard_normal((2, 3))
    stiffness = 1e6 * root @ root.T
    contacts = [
        contact("pressed", pressed, np.eye(3)[:1], k_t=NOTHING),
        contact("touched", touched, np.eye(3)[:1], k_t=NOTHING),
    ]
    # A motion along the second contact, which presses the first one, and the load that makes it.
    q = rng.standard_normal(3)
    q -= touched * (touched @ q) / (touched @ touched)
    q *= 1e-5 * np.sign(pressed @ q)
    rest = static_state(stiffness, contacts, (stiffness + 1e6 * np.outer(pressed, pressed)) @ q)
    # Round-off of motions of 1e-5 m, and springs whose stiffnesses differ by 1e6 at the most.
    np.testing.assert_allclose(rest.displacement, q, atol=1e-14)


@pytest.mark.parametrize("seed", range(12))
def test_a_block_that_opens_at_one_end_is_among_all_that_could_be(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(-2, 2, 6))
    contacts = block(places, gaps=1e-6 * rng.uniform(0, 1, 6))
    edge = places[-1] - rng.uniform(0.05, 0.2) * (places[-1] - places[0])
    load = pressed_at(float(edge), 50.0, push=float(rng.uniform(-5, 5)))
    none = np.zeros((3, 3))
    rest = static_state(none, contacts, load)
    every = every_rest(none, contacts, load)
    assert any(np.allclose(rest.displacement, q, rtol=1e-8, atol=1e-16) for _, q in every)
    assert not (rest.normal > 0).all()
    check_balance(none, contacts, load, rest)
    # Statics of the block, whatever its springs are: resultant and moment of the normal forces, and all of the push.
    np.testing.assert_allclose(rest.normal.sum(), 50.0, rtol=1e-10)
    np.testing.assert_allclose(np.concatenate(rest.tangential).sum(), load[0], rtol=1e-9)


def test_forces_of_a_pressed_end_are_those_of_a_wedge() -> None:
    # Feet at -2 ... 2, load at 1.4: those at -2 and -1 open, and the others have N = a + b x with sum P and moment P e.
    contacts = block(np.arange(-2.0, 3.0))
    rest = static_state(np.zeros((3, 3)), contacts, pressed_at(1.4, 60.0, push=6.0))
    a, b = np.linalg.solve([[3, 3], [3, 5]], [60.0, 60.0 * 1.4])
    np.testing.assert_allclose(rest.normal, [0, 0, a, a + b, a + 2 * b], atol=1e-10)
    # Equal tangential springs on a rigid block share the push.
    np.testing.assert_allclose(np.concatenate(rest.tangential), [0, 0, 2, 2, 2], atol=1e-10)
    np.testing.assert_allclose(
        rest.ratio, [0, 0, 2 / (0.5 * a), 2 / (0.5 * (a + b)), 2 / (0.5 * (a + 2 * b))], rtol=1e-9
    )
    assert rest.ratio[2] > 0.4
    # The line through the deflections is that of the wedge: gaps seen from rest go on where it rises from the ground.
    gaps = [item.gap for item in rest.contacts]
    np.testing.assert_allclose(gaps, [-(a - 2 * b) / 1e6, -(a - b) / 1e6, 0, 0, 0], rtol=1e-9)


def test_the_ratio_of_two_tangents_is_that_of_their_resultant() -> None:
    stiffness = np.diag([0.0, 0.0, 0.0])
    one = FrictionContact(
        name="one", normal=np.array([0.0, 0, 1]), tangents=np.eye(3)[:2], normal_stiffness=1e6,
        tangential_stiffness=2e6, friction_coefficient=0.25, friction=Friction.COULOMB,
    )  # fmt: skip
    rest = static_state(stiffness, [one], np.array([3.0, -4.0, 10.0]))
    np.testing.assert_allclose(rest.tangential[0], [3.0, -4.0], rtol=1e-12)
    np.testing.assert_allclose(rest.ratio, [5.0 / 2.5], rtol=1e-12)


def test_uncoupled_tangents_have_a_limit_each() -> None:
    one = replace(contact("one", np.array([0.0, 0, 1]), np.eye(3)[:2], mu=0.25), friction=Friction.UNCOUPLED)
    rest = static_state(np.zeros((3, 3)), [one], np.array([3.0, -4.0, 10.0]))
    np.testing.assert_allclose(rest.ratio, [4.0 / 2.5], rtol=1e-12)


def test_without_friction_any_tangential_force_is_beyond_the_limit() -> None:
    one = contact("one", np.array([0.0, 1.0]), np.array([[1.0, 0.0]]), mu=0.0)
    for push, ratio in ((3.0, np.inf), (0.0, 0.0)):
        rest = static_state(np.zeros((2, 2)), [one], np.array([push, 10.0]))
        np.testing.assert_array_equal(rest.ratio, [ratio])


def test_seen_from_rest_the_normal_law_is_the_same() -> None:
    rng = np.random.default_rng(5)
    contacts = block(np.arange(-2.0, 3.0), gaps=1e-6 * rng.uniform(-1, 1, 5))
    rest = static_state(np.zeros((3, 3)), contacts, pressed_at(1.4, 60.0))
    assert 0 < np.count_nonzero(rest.normal) < 5
    for motion in 1e-4 * rng.standard_normal((20, 3)):
        for before, after in zip(contacts, rest.contacts, strict=True):
            absolute = before.normal @ (rest.displacement + motion) - before.gap
            relative = after.preload + after.normal_stiffness * (after.normal @ motion - after.gap)
            # A spring of 1e6 N/m on a motion of 1e-4 m.
            np.testing.assert_allclose(max(relative, 0.0), max(1e6 * absolute, 0.0), atol=1e-10)


def test_contacts_keep_all_but_preload_and_gap() -> None:
    contacts = block(np.array([-1.0, 1.0]))
    rest = static_state(np.zeros((3, 3)), contacts, pressed_at(0.0, 10.0))
    for before, after in zip(contacts, rest.contacts, strict=True):
        assert (before.name, before.tangential_stiffness, before.friction_coefficient, before.friction) == (
            after.name, after.tangential_stiffness, after.friction_coefficient, after.friction)  # fmt: skip
        np.testing.assert_array_equal(before.directions, after.directions)


def test_a_structure_without_contacts_bends_under_its_load() -> None:
    rest = static_state(np.diag([2.0, 4.0]), [], np.array([1.0, 1.0]))
    np.testing.assert_allclose(rest.displacement, [0.5, 0.25], rtol=1e-15)
    assert rest.contacts == ()
    assert rest.ratio.shape == (0,)


def test_a_body_with_clearance_finds_the_stop_that_it_is_pushed_against() -> None:
    stops = [
        contact("left", np.array([-1.0]), np.eye(1), k_t=NOTHING, gap=1e-5),
        contact("right", np.array([1.0]), np.eye(1), k_t=NOTHING, gap=1e-5),
    ]
    rest = static_state(np.zeros((1, 1)), stops, np.array([5.0]))
    # The tangential spring is 1e-15 of the other.
    np.testing.assert_allclose(rest.normal, [0, 5], rtol=1e-12)
    # Both clearances, and 5 N on 1e6 N/m.
    np.testing.assert_allclose(rest.contacts[0].gap, 2e-5 + 5e-6, rtol=1e-12)


def test_a_preload_is_refused() -> None:
    feet = block(np.array([-1.0, 1.0]))
    pressed = contact("tight", feet[0].normal, feet[0].tangents)
    object.__setattr__(pressed, "preload", 3.0)
    with pytest.raises(JointError, match=r'contact "tight" has a preload, but this is a result of the static solution'):
        static_state(np.zeros((3, 3)), [feet[1], pressed], pressed_at(0.0, 10.0))


def test_a_body_that_is_pulled_off_has_no_rest() -> None:
    with pytest.raises(JointError, match=NO_REST):
        static_state(np.zeros((3, 3)), block(np.array([-1.0, 1.0])), pressed_at(0.0, -10.0))


def test_a_body_that_tips_over_has_no_rest() -> None:
    with pytest.raises(JointError, match=NO_REST):
        static_state(np.zeros((3, 3)), block(np.array([-1.0, 0.0, 1.0])), pressed_at(1.5, 10.0))


def test_a_body_that_no_contact_touches_has_no_rest() -> None:
    # Springs in one plane leave the third coordinate of two bodies free, whatever is pressed.
    contacts = [contact("only", np.array([1.0, 0, 0]), np.array([[0.0, 1, 0]]))]
    with pytest.raises(JointError, match=NO_REST):
        static_state(np.zeros((3, 3)), contacts, np.array([1.0, 0.0, 0.0]))


def test_a_line_with_a_gap_all_along_leaves_the_other_one() -> None:
    feet = block(np.array([-2.0, -1.0, 1.0, 2.0]), gaps=np.array([0, 0, 1e-3, 1e-3]))
    load = pressed_at(-1.4, 10.0)
    # Two feet carry the load by the law of the lever.
    np.testing.assert_allclose(static_state(np.zeros((3, 3)), feet, load).normal, [4, 6, 0, 0], atol=1e-9)
    with pytest.raises(JointError, match='under the static load "right" opens along its whole length'):
        static_state(np.zeros((3, 3)), feet, load, {"right": ["foot.3", "foot.4"]})


def test_a_line_that_opens_all_along_is_named() -> None:
    feet = block(np.array([-2.0, -1.0, 1.0, 2.0]), gaps=np.array([0, 0, 1e-3, 1e-3]))
    lines = {"left": ["foot.1", "foot.2"], "right": ["foot.3", "foot.4"]}
    load = pressed_at(-1.4, 10.0)
    soft = np.diag([0.0, 1e3, 1e3])
    assert (static_state(soft, feet, load).normal > 0).tolist() == [True, True, False, False]
    with pytest.raises(JointError, match=r'under the static load "right" opens along its whole length'):
        static_state(soft, feet, load, lines)
    # A line that keeps one of its stations stays.
    lines = {"left": ["foot.1"], "right": ["foot.2", "foot.3", "foot.4"]}
    assert static_state(soft, feet, load, lines).normal[1] > 0
