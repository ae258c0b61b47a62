"""A case for `stickslip solve`: what the file says is what the solver gets, and every mistake has its line."""

import re
from math import pi
from pathlib import Path

import numpy as np
import pytest

from casefile.errors import CaseError
from geometry.errors import InputError
from reduction.file.rom_hdf5 import save_rom
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsChain,
    JenkinsElement,
    QuadraticDamper,
)
from reduction.rom import ReducedModel
from reduction.stuck import stick_at_rest
from study.case.setup import read_case
from study.solve.model import SolveModel, make_solve_model

K = 1e6 * np.array([[2.0, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 1, 0], [0, 0, 0, 5]])
M = np.diag([1.0, 1, 1, 0.5])

CASE = """\
schema = 2
[structure]
kind = "plain"
file = "chain.npz"
[structure.damping]
ratio = "0.5 %"
[[joint]]
kind = "friction"
name = "tip"
normal = { dof = 3 }
tangent = { dof = 2, other = 1 }
second_tangent = { dof = 0 }
normal_stiffness = "2 N/um"
tangential_stiffness = "1 N/um"
friction_coefficient = 0.5
preload = "10 N"
gap = "-3 um"
friction = "coulomb"
[[joint]]
kind = "jenkins"
name = "slider"
dof = 1
tangential_stiffness = "3 N/um"
limit_force = "7 N"
[[joint]]
kind = "cubic"
name = "cubic"
weights = {1 = 1.0, 0 = -0.5}
stiffness = "2 N/mm^3"
[[joint]]
kind = "stop"
name = "stop"
dof = 0
stiffness = "4 N/um"
gap = "0.1 mm"
[[joint]]
kind = "quadratic_damper"
name = "air"
dof = 0
damping = "0.1 N*s^2/m^2"
[[static_load]]
dof = 3
force = "1.5 N"
[[load]]
dof = 0
amplitude = "5 N"
[[load]]
dof = 1
amplitude = "2 N"
harmonic = 3
phase = "90 deg"
[[sensor]]
name = "tip"
dof = 2
quantity = "velocity"
[harmonics]
highest = 5
[sweep]
parameter = "frequency"
from = "60 Hz"
to = "100 Hz"
levels = [1, 3]
"""


def model_of(folder: Path, text: str) -> SolveModel:
    if not (folder / "chain.npz").exists():
        np.savez(folder / "chain.npz", M=M, K=K)
    (folder / "my.toml").write_text(text)
    return make_solve_model(read_case(folder / "my.toml"))


def test_the_system_is_what_the_file_says(tmp_path: Path) -> None:
    model = model_of(tmp_path, CASE)
    tip, slider, cubic, stop, air = model.system.joints
    assert isinstance(tip, FrictionContact)
    np.testing.assert_array_equal(tip.tangents, [[0, -1, 1, 0], [1, 0, 0, 0]])
    np.testing.assert_array_equal(tip.normal, [0, 0, 0, 1])
    assert (tip.normal_stiffness, tip.tangential_stiffness) == (2e6, 1e6)
    assert (tip.friction_coefficient, tip.preload, tip.gap) == (0.5, 10.0, -3e-6)
    assert tip.friction is Friction.COULOMB
    assert isinstance(slider, JenkinsElement)
    assert (slider.tangential_stiffness, slider.limit_force) == (3e6, 7.0)
    assert isinstance(cubic, CubicSpring)
    np.testing.assert_array_equal(cubic.direction, [-0.5, 1, 0, 0])
    assert cubic.stiffness == 2e9
    assert isinstance(stop, ElasticStop)
    assert (stop.stiffness, stop.gap) == (4e6, 1e-4)
    assert isinstance(air, QuadraticDamper)
    assert air.damping == 0.1
    np.testing.assert_array_equal(model.system.static, [0, 0, 0, 1.5])
    expected = np.zeros((4, 4), complex)
    expected[1, 0], expected[3, 1] = 5, 2j
    np.testing.assert_allclose(model.system.dynamic, expected, atol=1e-15)  # cos 90 deg is round-off
    assert [(curve.fixed, curve.label) for curve in model.curves] == [(1.0, "level 1"), (3.0, "level 3")]
    assert model.curves[0].first == pytest.approx(120 * pi, rel=1e-15)
    assert (model.harmonics, model.n_sample, model.outputs[0].quantity) == (5, 0, "velocity")


CHAIN = """\
[[joint]]
kind = "jenkins_chain"
name = "chain"
dof = 1
tangential_stiffness = ["3 N/um", "1 N/um"]
limit_force = ["7 N", "2 N"]
[[static_load]]
"""


def test_a_law_takes_lists_of_numbers(tmp_path: Path) -> None:
    chain = model_of(tmp_path, CASE.replace("[[static_load]]\n", CHAIN)).system.joints[-1]
    assert isinstance(chain, JenkinsChain)
    assert (chain.tangential_stiffness, chain.limit_force, chain.stiffness) == ((3e6, 1e6), (7.0, 2.0), 0.0)
    for change in (('"7 N", "2 N"', '"7 N", "2 m"'), ('"7 N", "2 N"', ""), ('"7 N", "2 N"', '"7 N", "-2 N"')):
        with pytest.raises(CaseError, match="limit_force"):
            model_of(tmp_path, CASE.replace("[[static_load]]\n", CHAIN.replace(*change)))


def test_the_damping_ratio_is_met_on_the_first_stuck_mode(tmp_path: Path) -> None:
    system = model_of(tmp_path, CASE).system
    stuck = stick_at_rest(system.stiffness, system.joints)
    values, shapes = np.linalg.eigh(np.diag(np.diag(M) ** -0.5) @ stuck @ np.diag(np.diag(M) ** -0.5))
    shape = shapes[:, 0] / np.sqrt(np.diag(M))
    ratio = shape @ system.damping @ shape / (2 * np.sqrt(values[0]))
    # Two eigenvalue solvers agree to round-off.
    assert ratio == pytest.approx(0.005, rel=1e-10)
    assert not np.array_equal(stuck, system.stiffness)


def test_damping_of_the_file_is_replaced_only_when_asked(tmp_path: Path) -> None:
    np.savez(tmp_path / "chain.npz", M=M, K=K, C=2e-4 * K)
    with pytest.raises(CaseError, match=r"my.toml:6: structure.damping.ratio = .* add replace = true"):
        model_of(tmp_path, CASE)
    replaced = model_of(tmp_path, CASE.replace('ratio = "0.5 %"', 'ratio = "0.5 %"\nreplace = true'))
    assert not np.allclose(replaced.system.damping, 2e-4 * K)
    kept = model_of(tmp_path, CASE.replace('[structure.damping]\nratio = "0.5 %"\n', ""))
    np.testing.assert_array_equal(kept.system.damping, 2e-4 * K)


def test_a_level_sweep_has_one_curve_for_each_frequency(tmp_path: Path) -> None:
    sweep = 'parameter = "level"\nfrom = 0.5\nto = 8\nfrequencies = ["70 Hz", "80 Hz"]\n'
    model = model_of(tmp_path, CASE.split("parameter")[0].replace("highest = 5", "highest = 3\nsamples = 64") + sweep)
    assert [(curve.first, curve.last, curve.label) for curve in model.curves] == [(0.5, 8, "70 Hz"), (0.5, 8, "80 Hz")]
    assert model.curves[1].fixed == pytest.approx(160 * pi, rel=1e-15)
    assert model.n_sample == 64


ROM_CASE = """\
schema = 2
[structure]
kind = "plain"
file = "rom.h5"
[[joint]]
kind = "friction"
name = "slot"
normal = { at = "left", other_at = "right", direction = [0.6, 0.0, 0.8] }
tangent = { at = "left", other_at = "right", direction = "y" }
normal_stiffness = "2 N/um"
tangential_stiffness = "1 N/um"
friction_coefficient = 0.5
[[load]]
at = "left"
direction = "x"
amplitude = "6 N"
[[sensor]]
name = "tip"
at = "right"
station = 1
direction = "z"
[harmonics]
highest = 1
[sweep]
parameter = "frequency"
from = "60 Hz"
to = "100 Hz"
"""


def rom_case(folder: Path, text: str = ROM_CASE) -> SolveModel:
    n = 12  # two sets of two nodes, three directions each
    rom = ReducedModel(
        mass=np.eye(n),
        damping=0.1 * np.eye(n),
        stiffness=1e5 * np.eye(n),
        boundary_node=np.repeat(np.arange(4), 3),
        boundary_direction=np.tile(np.arange(3), 4),
        boundary_sets={"left": np.arange(6), "right": np.arange(6, 12), "three": np.arange(9)},
        fixed_interface_frequency=np.zeros(0),
        recovery=np.eye(n),
        free=np.arange(n),
        n_node=4,
    )
    save_rom(rom, folder / "rom.h5")
    return model_of(folder, text)


def test_names_of_a_reduced_model_make_one_contact_a_station(tmp_path: Path) -> None:
    model = rom_case(tmp_path)
    first, second = model.system.joints
    assert (first.name, second.name) == ("slot 0", "slot 1")
    assert isinstance(second, FrictionContact)
    expected = np.zeros(12)
    expected[[3, 5, 9, 11]] = 0.6, 0.8, -0.6, -0.8
    np.testing.assert_allclose(second.normal, expected, rtol=1e-15)
    np.testing.assert_array_equal(np.flatnonzero(second.tangents[0]), [4, 10])
    # A load is shared by the nodes; an output at one station is that node.
    np.testing.assert_array_equal(np.flatnonzero(model.system.dynamic[1]), [0, 3])
    assert model.system.dynamic[1].sum() == 6
    np.testing.assert_array_equal(np.flatnonzero(model.outputs[0].row), [11])


ROM_MISTAKES = [
    ('"left", other_at = "right", direction = "y"', '"lift", direction = "y"', 'no boundary set "lift": it has left'),
    ("station = 1", "station = 2", 'sensor[0].station = 2: .* boundary set "right" has stations 0 to 1'),
    ('other_at = "right", direction = "y"', 'other_at = "three", direction = "y"', "2 stations but other_at = .* 3:"),
    (
        '"y" }',
        '"y", station = 0 }',
        "different numbers of stations (normal 2, tangent 1): a contact needs one station of each",
    ),
    ("[0.6, 0.0, 0.8]", "[0, 0, 0]", "joint[0].normal: direction = [0, 0, 0] is not a direction"),
    ('direction = "z"', 'direction = "w"', 'sensor[0].direction = "w": must be "x", "y", "z", "rx",'),
    ('direction = "z"\n', "\n", 'at = "right" needs a direction'),
]


LOADS = CASE[CASE.index("[[load]]") : CASE.index("[[sensor]]")]
SENSOR = CASE[CASE.index("[[sensor]]") : CASE.index("[harmonics]")]
MISTAKES = [
    ("normal = { dof = 3 }", "normal = { dof = 30 }", "joint[0].normal: degree of freedom 30 .* has 0 to 3"),
    ("dof = 1\ntang", "dof = -1\ntang", "joint[1].dof = -1: must be greater than or equal to 0"),
    ("other = 1", "other = 2", "joint[0].tangent: .* does not move relative to itself"),
    ("{1 = 1.0, 0 = -0.5}", "{1 = 1.0, 10 = 1.0}", "joint[2]: degree of freedom 10 does not exist"),
    ("{1 = 1.0, 0 = -0.5}", "{1 = nan}", "joint[2].weights.1 = NaN: must be a finite number"),
    ("{1 = 1.0, 0 = -0.5}", "{}", "joint[2]: its weights are empty or all zero"),
    ('"2 N/um"', '"-2 N/um"', 'joint[0].normal_stiffness = "-2 N/um": must be greater than 0 N/m'),
    ('"4 N/um"', '"-4 N/um"', 'joint[3].stiffness = "-4 N/um": must be greater than 0 N/m\n'),
    ('stiffness = "4 N/um"', "", 'joint[3].stiffness is missing; add stiffness = "8.5 N/um"\n'),
    ('stiffness = "2 N/mm^3"', "", 'joint[2].stiffness is missing; add stiffness = "2.5 N/mm^3"\n'),
    ("friction_coefficient = 0.5", "", "friction_coefficient is missing; add friction_coefficient = 0.4\n"),
    (LOADS, "", "table [[load]] is missing, so nothing vibrates: add one"),
    (SENSOR, "", "table [[sensor]] is missing, so nothing is shown: add one"),
    ("coefficient = 0.5", "coefficient = -0.5", "friction_coefficient = -0.5: must be greater than or equal to 0"),
    ('"2 N/mm^3"', '"2 N/mm"', "makes it a stiffness, but a cubic stiffness is needed"),
    ('kind = "cubic"', 'kind = "cubi"', 'joint[2].kind = "cubi": must be .* did you mean "cubic"?'),
    ('name = "air"', 'name = "tip"', 'joint[4].name = "tip": .* is already used by joint[0]'),
    ('"5 N"', '"nan N"', 'load[0].amplitude = "nan N": is not a number'),
    ('"5 N"', "nan", "load[0].amplitude = NaN: give a unit"),
    ('"5 N"', '"1e999 N"', "is not a finite number"),
    ("[[load]]\ndof = 0", "[[load]]", "load[0]: no position is given: give one of dof, weights, at"),
    (
        "[[load]]\ndof = 0",
        '[[load]]\nat = "tip"\ndirection = "x"',
        "the structure is plain matrices: give dof or weights",
    ),
    ("[[load]]\ndof = 0", "[[load]]\ndof = 0\nweights = {0 = 1.0}", "dof and weights are given: give one of"),
    ("highest = 5", "highest = 2", "load[1].harmonic = 3: .* harmonics.highest = 2 drops this load; take at least 3"),
    ("highest = 5", "highest = -1", "harmonics.highest = -1: must be greater than or equal to 0"),
    (
        "highest = 5",
        "highest = 5\nsamples = 20",
        "samples = 20 are too few for harmonics 0 to 5: take at least 21,",
    ),
    ('to = "100 Hz"', 'to = "60 Hz"', "from and to are both 60 Hz: give two different ends"),
    ('from = "60 Hz"', 'from = "-60 Hz"', 'sweep.from = "-60 Hz": must be greater than 0'),
    ("[1, 3]", "[1, 1]", "1 appears twice: remove one"),
    ("[1, 3]", "[1, -3]", "sweep.levels[1] = -3: must be greater than 0"),
    ("[1, 3]", "[1, 1e300]", "sweep.levels[1] = 1e+300: must lie between 1e-12 and 1e+12: it scales the loads"),
    ("[1, 3]", "[1e-13]", "sweep.levels[0] = 1e-13: must lie between 1e-12 and 1e+12"),
    ("[1, 3]", "[]", "sweep.levels = []: must have at least 1, not 0"),
    ("[1, 3]", "[nan]", "sweep.levels[0] = NaN: nan is not a finite number"),
    ('parameter = "frequency"', 'parameter = "freq"', 'sweep.parameter = "freq": must be "frequency" or "level"'),
    ('"chain.npz"', '"none.npz"', 'structure.file = "none.npz": the file cannot be used: there is no file'),
]


@pytest.mark.parametrize(("right", "wrong", "said"), MISTAKES, ids=[wrong for _, wrong, _ in MISTAKES])
def test_a_mistake_is_one_line_with_file_line_value_and_remedy(
    tmp_path: Path, right: str, wrong: str, said: str
) -> None:
    assert right in CASE
    with pytest.raises(InputError) as refused:
        model_of(tmp_path, CASE.replace(right, wrong, 1))
    pattern = ".*".join(map(re.escape, said.split(".*")))
    # What is said may ask for the end of the line.
    assert re.search(rf"my\.toml:\d+.*{pattern}", f"{refused.value}\n")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("right", "wrong", "said"), ROM_MISTAKES, ids=[wrong for _, wrong, _ in ROM_MISTAKES])
def test_a_mistake_in_the_names_of_a_reduced_model_is_shown(tmp_path: Path, right: str, wrong: str, said: str) -> None:
    assert right in ROM_CASE
    with pytest.raises(CaseError, match=".*".join(map(re.escape, said.split(".*")))):
        rom_case(tmp_path, ROM_CASE.replace(right, wrong, 1))


def test_all_mistakes_are_shown_together(tmp_path: Path) -> None:
    wrong = CASE.replace("normal = { dof = 3 }", "normal = { dof = 30 }").replace("highest = 5", "highest = 0")
    wrong = wrong.replace("[[static_load]]\ndof = 3", "[[static_load]]\ndof = 4")
    with pytest.raises(CaseError) as refused:
        model_of(tmp_path, wrong)
    keys = [problem.key for problem in refused.value.problems]
    assert keys == ["joint[0].normal", "static_load[0]", "load[0]", "load[1].harmonic"]
