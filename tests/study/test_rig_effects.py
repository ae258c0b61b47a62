"""Effects of a coarse rig's set-up: each is the case that says the same, and each is an axis of a sweep."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.model import LineSensor, Model, Sensor
from correlation.model_solver import ModelSolver
from correlation.prediction import Points, Predictor
from diagnosis.candidate.catalogue import Catalogue, list_effects
from diagnosis.fit.calibration_parameter import CalibratedEffect, list_calibration_parameters
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.tangent import differentiate
from fe.dense_modes import compute_dense_modes
from reduction.static_contact import StaticState
from study.case.added import format_parameter, read_parameter
from study.case.setup import ReadCase
from study.kind.registry import open_case
from study.sweep.parameter import find_parameter, vary

ReadRig = Callable[[str], ReadCase]
MORE = "[harmonics]\nhighest = 3\nsamples = 64\n"
LINES = ("left_blade", "left_decoupler", "right_blade", "right_decoupler")


@pytest.fixture(scope="module")
def plain(read_rig: ReadRig) -> ReadCase:
    return read_rig(MORE)


@pytest.fixture(scope="module")
def listed(plain: ReadCase) -> Catalogue:
    return list_effects(plain.model)


def mean_forces(model: Model, rest: StaticState) -> np.ndarray:
    """Mean N and T of each line under a force that hardly moves anything, from a rest, shape (2, 4) [N]."""
    sensors = [LineSensor(name=f"{one} {what}", line=one, component=what) for what in WHATS for one in LINES]
    solver = ModelSolver.from_model(replace(model, sensors=tuple(sensors)), free=False, slider=lambda _: rest.slider)
    state = solver.solve(1e-6, 100.0, solver.slider, ())
    assert state is not None
    names = np.array([item.name for item in sensors])
    return solver.read(state, names, np.zeros(len(names), dtype=int)).real.reshape(2, 4)


WHATS = ("normal", "tangential")


@pytest.mark.parametrize(
    ("name", "strength", "table"),
    [
        ("shift of left dead weight", -2.4e-3, 'shift = "-2.4 mm"'),
        ("inclination of left dead weight", np.deg2rad(-3.0), 'inclination = "-3 deg"'),
    ],
)
def test_a_wire_that_is_moved_presses_as_the_case_that_says_so(
    read_rig: ReadRig, plain: ReadCase, listed: Catalogue, name: str, strength: float, table: str
) -> None:
    said = read_rig(MORE + f"[structure.dead_weight.left]\n{table}\n")
    changed = listed.effect(name).apply(plain.model, [strength])
    at_rest = plain.structure.details.static_state
    result, before = (mean_forces(model, at_rest) for model in (changed, plain.model))
    expected = mean_forces(said.model, said.structure.details.static_state)
    own, other = changed.dead_weights["left dead weight"].row, said.model.dead_weights["left dead weight"].row
    np.testing.assert_allclose(own, other, atol=1e-9 * np.abs(other).max())
    assert np.abs(expected - before).max() > 0.5
    # All contacts stick, so that the order in which the wire was loaded and moved does not matter; round-off of
    # static solutions of forces of 30 N.
    np.testing.assert_allclose(result, expected, atol=1e-3)


def test_the_width_of_a_wire_changes_its_load_and_hardly_the_contacts(read_rig: ReadRig, plain: ReadCase) -> None:
    thin = read_rig(MORE + '[structure.dead_weight]\nwidth = "1 mm"\n')
    own, other = (item.model.dead_weights["left dead weight"].row for item in (plain, thin))
    assert np.abs(own - other).max() > 1e-3 * np.abs(own).max()
    result, expected = (mean_forces(item.model, item.structure.details.static_state)[0] for item in (thin, plain))
    # A damper is nearly rigid beside its contacts.
    np.testing.assert_allclose(result, expected, rtol=0.01)


def test_normal_forces_follow_the_lever_of_the_wire(plain: ReadCase, listed: Catalogue) -> None:
    damper = plain.structure.details.model.rig.damper
    shift = 1e-3
    moved = listed.effect("shift of right dead weight").apply(plain.model, [shift])
    at_rest = plain.structure.details.static_state
    change = (mean_forces(moved, at_rest) - mean_forces(plain.model, at_rest))[0]
    theta = damper.cone_half_angle
    # A damper on two supports in the middles of its lines: the far line gains F s / span upwards.
    span = damper.cylinder_length + 2 * damper.shoulder + damper.contact_length
    expected = 55 * shift / span / np.cos(theta)
    # Lines are as long as their distance from the middle, and bear along all of their length.
    assert change[LINES.index("right_decoupler")] == pytest.approx(expected, rel=0.25)
    assert change[LINES.index("right_blade")] == pytest.approx(-expected, rel=0.25)
    assert np.abs(change[:2]).max() < 0.05 * expected


def test_a_relaxed_clamp_is_the_case_with_springs(read_rig: ReadRig, plain: ReadCase, listed: Catalogue) -> None:
    said = read_rig(MORE + '[structure.root]\nstiffness = "1000 N/um"\n')
    effect = listed.effect("compliance of the clamp of blade")
    relaxed = effect.apply(plain.model, [1e-9])
    for name in ("mass", "stiffness"):
        one, other = getattr(relaxed.system, name), getattr(said.model.system, name)
        # Round-off of differences of matrices.
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9 * np.abs(other).max())
    # Back to a fixed clamp, and not beyond.
    stiff = list_effects(said.model).effect("compliance of the clamp of blade")
    assert stiff.parameters[0].lower == pytest.approx(-1e-9)
    fixed = stiff.apply(said.model, [-1e-9])
    np.testing.assert_allclose(
        fixed.system.stiffness, plain.model.system.stiffness, atol=1e-9 * np.abs(plain.model.system.stiffness).max()
    )


def test_the_typical_compliance_lowers_the_first_resonance_by_half_a_percent(
    plain: ReadCase, listed: Catalogue
) -> None:
    effect = listed.effect("compliance of the clamp of blade")
    softer = effect.apply(plain.model, [effect.parameters[0].typical])
    own, other = (
        np.sort(
            np.linalg.eigvals(
                np.linalg.solve(model.without_contacts().system.mass, model.without_contacts().system.stiffness)
            ).real
        )
        for model in (plain.model, softer)
    )
    # The free blade is the first one above the pendulums of the dampers at 20 Hz, of six motions.
    blade = [np.sqrt(item[item > (2 * np.pi * 50) ** 2][0]) for item in (own, other)]
    assert 0.001 < 1 - blade[1] / blade[0] < 0.006


def test_density_modulus_and_clamp_change_the_model_as_the_case(
    read_rig: ReadRig, plain: ReadCase, listed: Catalogue
) -> None:
    said = read_rig(
        MORE + '[structure.root]\nstiffness = "1000 N/um"\n[structure.blade_material]\ndensity = "7020 kg/m^3"\n',
    )
    light = listed.effect("density of blade").apply(plain.model, [0.9])
    both = listed.effect("compliance of the clamp of blade").apply(light, [1e-9])
    # Another density changes which modes are the lowest of all bodies and kept.
    own, columns = (item.structure.details.reduction.assembly.columns("blade") for item in (plain, said))
    one, other = (
        compute_dense_modes(item.system.mass[of, of], item.system.stiffness[of, of]).frequency[:3]
        for item, of in ((both, own), (said.model, columns))
    )
    np.testing.assert_allclose(one, other, rtol=1e-4)
    (modulus,) = (item for item in list_calibration_parameters(said.model) if item.name == "E")
    stiffer = modulus.apply(said.model, [1.01])
    before, after = (item.elastic_bodies["blade"].matrices[1] for item in (said.model, stiffer))
    others = sum(part.stiffness for part in said.model.parts if part.name != "blade")
    change = stiffer.system.stiffness - said.model.system.stiffness
    np.testing.assert_allclose(change, after - before + 0.01 * others, atol=1e-9 * np.abs(before).max())
    mass = said.model.elastic_bodies["blade"].matrices[0][columns, columns]
    low, high = (compute_dense_modes(mass, item[columns, columns]).frequency[0] for item in (before, after))
    # The springs of the clamp stay: the frequency rises by less than the root of 1.01.
    assert 1.003 < high / low < 1.0049


def test_a_leaning_head_is_the_case_with_the_angle(read_rig: ReadRig, plain: ReadCase, listed: Catalogue) -> None:
    said = read_rig(MORE + '[structure.laser]\nblade = "7 deg"\n').model
    name = "damper left against blade"
    turned = listed.effect(f"lean of {name} at blade").apply(plain.model, [np.deg2rad(7.0)])
    one, other = (next(item for item in m.sensors if item.name == name) for m in (turned, said))
    assert isinstance(one, Sensor)
    assert isinstance(other, Sensor)
    np.testing.assert_allclose(one.row, other.row, atol=1e-14)


def test_effects_are_added_to_a_case_with_their_units(read_rig: ReadRig, plain: ReadCase) -> None:
    added = {
        "shift of left dead weight": ("shift", "-2.4 mm", -2.4e-3),
        "inclination of left dead weight": ("angle", "-3 deg", np.deg2rad(-3)),
        "compliance of the clamp of blade": ("compliance", "0.5 nm/N", 0.5e-9),
        "lean of damper left against blade at damper": ("angle", "0.2 rad", 0.2),
    }
    tables = "".join(f'[[added]]\neffect = "{name}"\n{key} = "{text}"\n' for name, (key, text, _) in added.items())
    said = read_rig(MORE + tables)
    for item, (_, text, value) in zip(said.setup.added, added.values(), strict=True):
        assert item.values == pytest.approx([value])
        (parameter,) = item.effect.parameters
        assert read_parameter(format_parameter(value, parameter), parameter) == pytest.approx(value, rel=1e-5), text
    wire = said.model.dead_weights["left dead weight"].wire
    assert wire is not None
    assert (wire.shift, wire.inclination) == pytest.approx((-2.4e-3, np.deg2rad(-3)))
    assert said.model.elastic_bodies["blade"].compliance == 0.5e-9
    assert plain.model.elastic_bodies["blade"].compliance == 0.0
    swept = find_parameter(said.opened, "shift of left dead weight.shift", "mm")
    varied = vary(said.opened, {swept: swept.written(1.0)}).case
    assert varied.added[0].values["shift"] == "1.0 mm"


def test_an_effect_with_a_prior_is_a_calibration_parameter(plain: ReadCase, listed: Catalogue) -> None:
    shift = CalibratedEffect.from_effect(listed.effect("shift of left dead weight"), 1e-3)
    unknowns = Unknowns.from_effects(plain.model, [(shift, shift.deviation)], [])
    assert unknowns.names == ("shift of left dead weight",)
    # Five standard deviations are less than the effect's own bounds.
    assert unknowns.bounds == [(-5e-3, 5e-3)]
    assert unknowns.prior == pytest.approx([1e-3])
    changed = unknowns.compose(np.array([2e-3]))
    wire = changed.dead_weights["left dead weight"].wire
    assert wire is not None
    assert wire.shift == 2e-3


def test_derivatives_of_forces_and_motion_are_those_of_differences(plain: ReadCase, listed: Catalogue) -> None:
    names = ["shift of left dead weight", "inclination of right dead weight", "compliance of the clamp of blade"]
    effects = [listed.effect(name) for name in names]
    lines = [LineSensor(name=f"{line} {what}", line=line, component=what) for line in LINES for what in WHATS]
    base = replace(plain.model, sensors=(plain.model.sensors[0], *lines))
    unknowns = Unknowns.from_effects(base, (), effects)
    seen = [("tip", 1), *((item.name, 0) for item in lines)]
    sensor, harmonic = (np.array(column) for column in zip(*seen, strict=True))
    n = len(seen)
    points = Points(
        free=np.zeros(n, dtype=bool), level=np.ones(n), frequency=np.full(n, 150.0), sensor=sensor, harmonic=harmonic
    )
    rest = plain.structure.details.static_state
    predictor = Predictor(points=points, slider=lambda _: rest.slider)
    values = unknowns.vanishing + 0.3 * unknowns.size
    model = unknowns.compose(values)
    prediction = predictor.predict(model)
    tangents = differentiate(unknowns.compose, values, unknowns.size, unknowns.bounds)
    known = [item for item in tangents if item is not None]
    assert len(known) == len(names)
    slopes = predictor.derivatives(model, prediction, known) * unknowns.size
    for number in range(len(names)):
        step = 0.1 * unknowns.size[number] * np.eye(len(names))[number]
        high, low = (predictor.predict(unknowns.compose(values + sign * step)).value for sign in (1, -1))
        difference = (high - low) / 0.2
        size = np.where(harmonic == 0, np.abs(difference[1:]).max(), np.abs(difference[0]))
        # Central differences of smooth numbers: all contacts stick at this level.
        np.testing.assert_array_less(np.abs(slopes[:, number] - difference), 1e-3 * size + 1e-12)


@pytest.mark.parametrize(
    ("key", "unit", "value"),
    [
        ("structure.root.stiffness", "N/um", 1500.0),
        ("structure.blade_material.density", "kg/m^3", 7600.0),
        ("structure.dead_weight.left.shift", "mm", -1.0),
        ("structure.dead_weight.right.inclination", "deg", 3.0),
        ("structure.contact.left_blade.gap_angle", "deg", 0.05),
        ("structure.laser.damper", "deg", 13.0),
        ("structure.accelerometer.mass", "g", 2.0),
        ("structure.stinger.stiffness", "N/um", 0.1),
    ],
)
def test_what_the_set_up_has_is_an_axis_of_a_sweep(
    tmp_path: Path, short_rig: str, key: str, unit: str, value: float
) -> None:
    file = tmp_path / "swept.toml"
    file.write_text(short_rig, encoding="utf-8")
    opened = open_case(file)
    parameter = find_parameter(opened, key, unit)
    varied: object = vary(opened, {parameter: parameter.written(value)}).case
    for part in key.split("."):
        varied = getattr(varied, part)
    factor = {"N/um": 1e6, "kg/m^3": 1.0, "mm": 1e-3, "deg": np.pi / 180, "g": 1e-3}[unit]
    assert varied == pytest.approx(value * factor)
