"""Typical strengths do what they are called typical for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvalsh

from correlation.model import Dof, Model, Sensor
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.scale import measure_scale
from reduction.jointed_system import JenkinsElement, JointedSystem, along
from reduction.stuck import stuck_stiffness

MASS, STIFFNESS, DAMPING, LEVEL = 2.0, 8e3, 0.9, 3.0
OMEGA = np.sqrt(STIFFNESS / MASS)
AMPLITUDE = LEVEL / (DAMPING * OMEGA)


def oscillator(direction: str = "z") -> Model:
    row, force = along(1, {0: 1.0}), np.array([[0.0], [1.0]])
    system = JointedSystem(mass=[[MASS]], damping=[[DAMPING]], stiffness=[[STIFFNESS]], harmonic_force=force)
    return Model(
        system=system, sensors=(Sensor(name="s", row=row),), dofs=(Dof(direction=direction),), places={"p": row}
    )


def typical(model: Model, name: str, level: float = LEVEL) -> float:
    return list_effects(model, level=level).effect(name).parameters[0].typical


def stuck(model: Model) -> float:
    return float(np.sqrt(eigvalsh(stuck_stiffness(model.system.stiffness, model.system.joints), model.system.mass)[0]))


def test_strengths_of_an_oscillator_are_those_of_its_closed_forms() -> None:
    model = oscillator()
    (resonance,) = measure_scale(model, level=LEVEL).resonances
    assert resonance.angular_frequency == pytest.approx(OMEGA)
    assert resonance.amplitude(model.places["p"]) == pytest.approx(AMPLITUDE)
    assert resonance.modal_mass(model.places["p"]) == pytest.approx(MASS)
    assert typical(model, "spring at p") == pytest.approx((1.005**2 - 1) * STIFFNESS)
    assert typical(model, "mass at p") == pytest.approx((0.995**-2 - 1) * MASS)
    assert typical(model, "dashpot at p") == pytest.approx(0.1 * DAMPING)


def test_a_typical_cubic_spring_is_the_typical_spring_in_its_first_harmonic() -> None:
    model = oscillator()
    angle = 2 * np.pi * np.arange(64) / 64
    force = typical(model, "cubic at p") * (AMPLITUDE * np.cos(angle)) ** 3
    harmonic = 2 * np.mean(force * np.cos(angle))
    assert harmonic == pytest.approx(typical(model, "spring at p") * AMPLITUDE)


def test_typical_drag_dissipates_a_tenth_of_the_linear_damping() -> None:
    model = oscillator()
    angle = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    speed = -OMEGA * AMPLITUDE * np.sin(angle)
    work = 2 * np.pi / OMEGA * np.mean(typical(model, "air damping at p") * np.abs(speed) ** 3)
    # The sum over |sin|^3 converges with the fourth power of the step.
    assert work == pytest.approx(0.1 * np.pi * DAMPING * OMEGA * AMPLITUDE**2, rel=1e-9)


@pytest.mark.parametrize("configurations", [["jointed"], ["free"], ["jointed", "free"]])
def test_typical_springs_and_masses_shift_the_first_frequency_that_is_tested_by_half_a_percent(
    bench: Model, configurations: list[str]
) -> None:
    seen = set()
    for effect in list_effects(bench, configurations=configurations).candidates:
        if effect.kind in {"spring", "mass"}:
            parameter = effect.parameters[0]
            changed = effect.apply(bench, [parameter.typical])
            ratio = {
                "jointed": stuck(changed) / stuck(bench),
                "free": stuck(changed.without_contacts()) / stuck(bench.without_contacts()),
            }
            # Of the tested ones, the one that shifts most.
            most = max((ratio[item] for item in configurations), key=lambda item: abs(item - 1))
            down = effect.kind == "mass" or parameter.typical < 0
            assert most == pytest.approx(0.995 if down else 1.005, rel=1e-9), effect.name
            seen.add(effect.name)
    assert {"spring at tip z", "mass at tip z", "spring between root z and stand z"} <= seen


def test_a_place_of_no_consequence_is_not_tested(bench: Model) -> None:
    result = list_effects(bench, configurations=["jointed"])
    with pytest.raises(EffectError, match="no stiffness there can shift the first resonance"):
        result.effect("spring at stand z")
    with pytest.raises(EffectError, match="of the largest motion in the first mode"):
        result.effect("dashpot at stand z")


def test_where_no_spring_is_stiff_enough_taking_stiffness_away_is_typical() -> None:
    root = 1.5e6  # N/m; a support that hardly gives
    M = np.diag([0.01, 1.0])
    K = np.array([[root + 1e4, -1e4], [-1e4, 1e4]])
    rows = {"root": along(2, {0: 1.0}), "tip": along(2, {1: 1.0})}
    system = JointedSystem(mass=M, damping=1e-4 * K, stiffness=K, harmonic_force=[[0, 0], [0, 1]])
    model = Model(system=system, sensors=(), places=rows)
    strength = typical(model, "spring at root")
    assert -0.9 * root < strength < 0
    relaxed = list_effects(model).effect("spring at root").apply(model, [strength])
    assert stuck(relaxed) / stuck(model) == pytest.approx(0.995, rel=1e-9)


def test_a_spring_joins_places_of_two_bodies_along_one_direction(bench: Model) -> None:
    result = list_effects(bench)
    joining = [name for name in result.names if "between" in name]
    assert joining == ["spring between tip z and stand z", "spring between root z and stand z"]
    changed = result.effect("spring between root z and stand z").apply(bench, [1e5])
    # Its place points the other way: the spring is in the difference of the displacements all the same.
    rigid = along(7, {0: 1.0, 6: 1.0})
    assert rigid @ changed.system.stiffness @ rigid == pytest.approx(rigid @ bench.system.stiffness @ rigid)


def test_strengths_scale_with_the_level_as_their_exponents() -> None:
    model = oscillator()
    for name, power in {"spring at p": 0, "dashpot at p": 0, "air damping at p": -1, "cubic at p": -2}.items():
        assert typical(model, name, 10 * LEVEL) == pytest.approx(10.0**power * typical(model, name))


def test_a_rotation_asks_for_moments() -> None:
    result = list_effects(oscillator("rx"))
    units = {item.kind: item.parameters[0].unit for item in result.candidates}
    assert units["spring"] == units["cubic"] == "N m"
    assert (units["mass"], units["dashpot"], units["air damping"]) == ("kg m^2", "N m s", "N m s^2")


def test_the_first_mode_that_the_force_drives_sets_the_scale(bench: Model) -> None:
    free, jointed = measure_scale(bench).resonances
    assert jointed.angular_frequency == pytest.approx(stuck(bench))
    assert free.angular_frequency == pytest.approx(stuck(bench.without_contacts()))
    M, K = np.eye(2), np.diag([1e4, 4e4])
    system = JointedSystem(mass=M, damping=1e-4 * K, stiffness=K, harmonic_force=[[0, 0], [0, 1]])
    (driven,) = measure_scale(Model(system=system, sensors=())).resonances
    assert driven.angular_frequency == pytest.approx(200.0)


def test_what_contacts_alone_hold_has_no_free_resonance(bench: Model) -> None:
    floating = bench.with_system(stiffness=np.zeros((7, 7)) + np.diag([1e6] * 2 + [0.0] * 4 + [1e6]))
    held = floating.with_system(stiffness=floating.system.stiffness + 1e-3 * np.diag([0, 0, 1.0, 1, 1, 1, 0]))
    assert len(measure_scale(held).resonances) == 2
    assert len(measure_scale(floating).resonances) == 1
    assert list_effects(floating).effect("spring at tip z").parameters[0].lower == 0  # nothing to take away


def test_a_jenkins_element_holds_what_sticks() -> None:
    model = oscillator()
    slider = JenkinsElement(name="j", direction=[1.0], tangential_stiffness=3 * STIFFNESS, limit_force=1.0)
    held = model.with_system(joints=[slider])
    assert measure_scale(held).resonances[0].angular_frequency == pytest.approx(2 * OMEGA)


def test_bad_scales_are_refused_in_words() -> None:
    model = oscillator()
    with pytest.raises(EffectError, match="level = -3 N must be positive"):
        measure_scale(model, level=-3.0)
    with pytest.raises(EffectError, match='"glued" is not a configuration: give any of jointed, free'):
        measure_scale(model, configurations=["glued"])
    with pytest.raises(EffectError, match="all contacts stuck is 0 Hz"):
        measure_scale(replace(model, parts=(), system=replace(model.system, stiffness=[[0.0]])))
    with pytest.raises(EffectError, match="not positive definite"):
        measure_scale(replace(model, parts=(), system=replace(model.system, mass=[[-1.0]])))
