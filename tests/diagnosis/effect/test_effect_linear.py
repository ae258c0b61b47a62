"""What effects at places, of parts and of sensors do to a model."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Dof, Model, StructurePart
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import EffectError
from reduction.jointed_system import CubicSpring, QuadraticDamper, along


def applied(model: Model, name: str, value: float) -> Model:
    return list_effects(model).effect(name).apply(model, [value])


def reason(model: Model, name: str) -> str:
    (left,) = [item for item in list_effects(model).untestable if item.name == name]
    return left.reason


def test_springs_and_dashpots_add_to_their_matrix_along_the_row(bench: Model) -> None:
    row = bench.places["slot z"]
    stiffer = applied(bench, "spring at slot z", 7.0).system
    np.testing.assert_allclose(stiffer.stiffness - bench.system.stiffness, 7 * np.outer(row, row), atol=1e-9)
    damped = applied(bench, "dashpot at slot z", 7.0).system
    np.testing.assert_allclose(damped.damping - bench.system.damping, 7 * np.outer(row, row), atol=1e-12)


def test_a_mass_moves_with_all_translations_of_its_node(bench: Model) -> None:
    added = applied(bench, "mass at tip z", 0.1).system.mass - bench.system.mass
    np.testing.assert_allclose(added, np.diag([0, 0, 0, 0, 0.1, 0.1, 0]), atol=1e-15)
    assert reason(bench, "mass at tip x") == 'it is the mass at "tip z": one node'


def test_a_mass_between_nodes_or_on_unknown_ones_moves_along_its_row(bench: Model) -> None:
    row = bench.places["slot z"]
    added = applied(bench, "mass at slot z", 0.1).system.mass - bench.system.mass
    np.testing.assert_allclose(added, 0.1 * np.outer(row, row), atol=1e-15)
    unknown = replace(bench, dofs=(Dof(),) * 7)
    added = applied(unknown, "mass at tip z", 0.1).system.mass - bench.system.mass
    np.testing.assert_allclose(added, np.diag([0, 0, 0, 0, 0.1, 0, 0]), atol=1e-15)


def test_the_density_of_a_part_scales_its_mass(bench: Model) -> None:
    mass = applied(bench, "density of beam", 2.0).system.mass
    np.testing.assert_allclose(mass, bench.system.mass + bench.parts[0].mass, rtol=1e-15)
    whole = replace(bench, parts=())
    np.testing.assert_allclose(applied(whole, "density of all", 2.0).system.mass, 2 * bench.system.mass, rtol=1e-15)
    massless = replace(
        bench, parts=(*bench.parts, StructurePart(name="shim", mass=np.zeros((7, 7)), stiffness=np.eye(7)))
    )
    assert reason(massless, "density of shim") == "the part has no mass"


def test_cubic_springs_and_drag_are_joints_at_their_place(bench: Model) -> None:
    *rest, spring = applied(bench, "cubic at tip z", -3.0).system.joints
    assert isinstance(spring, CubicSpring)
    assert spring.stiffness == -3.0
    *_, damper = applied(bench, "air damping at tip z", 3.0).system.joints
    assert isinstance(damper, QuadraticDamper)
    assert damper.damping == 3.0
    for joint in (spring, damper):
        np.testing.assert_array_equal(joint.directions, bench.places["tip z"][None])
    assert tuple(rest) == tuple(bench.system.joints)


def test_a_gain_scales_what_its_sensor_reads(bench: Model) -> None:
    assert [item.gain for item in applied(bench, "gain of left_N", 1.1).sensors] == [1.0, 1.0, pytest.approx(1.65)]


def test_a_delay_adds_to_that_of_its_sensor(bench: Model) -> None:
    late = applied(applied(bench, "delay of left_N", 1e-4), "delay of left_N", 2e-4)
    assert [item.delay for item in late.sensors] == [0.0, 0.0, pytest.approx(3e-4)]


def test_places_that_cannot_act_are_listed_with_their_reason(bench: Model) -> None:
    more = {
        "nowhere": np.zeros(7),
        "end z": along(7, {4: -2.0}),
        "tip x": bench.places["tip x"],
    }
    stiff = bench.with_system(stiffness=bench.system.stiffness + 1e12 * np.diag([0, 0, 0, 0, 0, 1.0, 0]))
    model = replace(stiff, places={"tip z": bench.places["tip z"], **more}, parts=())
    for kind in ("spring", "mass", "cubic", "air damping", "dashpot"):
        assert reason(model, f"{kind} at nowhere") == "it does not move: its row is zero"
        assert reason(model, f"{kind} at end z") == 'it moves with "tip z"'
        assert "of the largest motion in the first mode" in reason(model, f"{kind} at tip x")
    assert "has no named places" in reason(replace(bench, places={}), "cubic")


def test_without_a_force_nothing_nonlinear_can_be_tested(bench: Model) -> None:
    silent = bench.with_system(harmonic_force=None)
    for kind in ("cubic", "air damping"):
        assert reason(silent, f"{kind} at tip z") == "the model has no harmonic force that would move it"
    with pytest.raises(EffectError, match='"cubic at tip z" cannot be tested'):
        list_effects(silent).effect("cubic at tip z")
