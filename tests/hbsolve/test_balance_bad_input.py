"""What the harmonic balance cannot use is refused in one sentence that shows it."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import eye_array

import hbsolve.solution
import hbsolve.steady_state
from geometry.errors import InputError
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion, contact_share
from hbsolve.continuation.branch import load_branch
from hbsolve.continuation.continuation_parameter import FrequencyPath, JointPath
from hbsolve.continuation.response import begin, frequency_response, joint_response, level_response, make_branch
from hbsolve.continuation.step import Continuation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.energy import energy_balance
from hbsolve.errors import BalanceError, DampingWarning, Failure, ModelError, NoSteadyState
from hbsolve.model_rates import MatrixParameter
from hbsolve.sensitivity import (
    JointParameter,
    LevelParameter,
    LoadParameter,
    Parameter,
    SliderParameter,
    point_mass,
    scaled,
    sensitivity,
)
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from hbsolve.truncation import truncation
from reduction.errors import JointError
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    FrictionContact,
    JenkinsElement,
    JointedSystem,
    QuadraticDamper,
    along,
    between,
)

X, Y = np.eye(2)


def contact(**changes: object) -> FrictionContact:
    given: dict[str, object] = {
        "name": "rub",
        "normal": Y,
        "tangents": X,
        "normal_stiffness": 2.0,
        "tangential_stiffness": 1.0,
        "friction_coefficient": 0.4,
        "preload": 0.3,
    }
    return FrictionContact(**(given | changes))  # type: ignore[arg-type]


def system(**changes: object) -> JointedSystem:
    given: dict[str, object] = {
        "mass": np.eye(2),
        "damping": 0.02 * np.eye(2),
        "stiffness": np.eye(2),
        "joints": [contact(), CubicSpring(name="cubic", direction=X, stiffness=0.1)],
        "harmonic_force": [[0, 0], [0.2, 0]],
    }
    return JointedSystem(**(given | changes))  # type: ignore[arg-type]


def balance(n_harmonic: int = 4, **changes: object) -> HarmonicBalance:
    return HarmonicBalance(system=system(**changes), n_harmonic=n_harmonic)


def duffing() -> HarmonicBalance:
    one, force = np.eye(1), np.array([[0], [0.1 + 0j]])
    spring = CubicSpring(name="cubic", direction=one[0], stiffness=0.1)
    made = JointedSystem(mass=one, damping=0.1 * one, stiffness=one, joints=[spring], harmonic_force=force)
    return HarmonicBalance(system=made, n_harmonic=2)


Refused = Callable[[], object]

DATA: dict[str, tuple[Refused, str]] = {
    "mass that is not square": (lambda: system(mass=np.ones((2, 3))), r"mass has shape \(2, 3\)"),
    "damping of another size": (lambda: system(damping=np.eye(3)), r"damping has shape \(3, 3\), the mass \(2, 2\)"),
    "empty matrices": (lambda: system(mass=np.zeros((0, 0))), r"mass has shape \(0, 0\)"),
    "infinite structural damping": (
        lambda: system(stiffness=[[1, 0], [0, complex(1, np.inf)]]),
        r"the structural damping holds inf at \(1, 1\): give finite numbers",
    ),
    "complex mass": (lambda: system(mass=[[1, 0], [2j, 1]]), r"the mass holds 0\+2j at \(1, 0\): give real numbers"),
    "complex damping": (lambda: system(damping=1j * np.eye(2)), r"the damping holds 0\+1j at \(0, 0\)"),
    "complex static load": (
        lambda: system(static_load=[0, 3j]),
        r"the static load holds 0\+3j at 1: give real numbers",
    ),
    "words in the mass": (lambda: system(mass=[["1", 0], [0, "1"]]), r"the mass holds '1' at \(0, 0\): give numbers"),
    "nothing in the damping": (lambda: system(damping=[[0, None], [0, 0]]), r"the damping holds None at \(0, 1\)"),
    "no stiffness": (lambda: system(stiffness=None), r"the stiffness holds None: give numbers"),
    "sparse stiffness beyond memory": (
        lambda: system(stiffness=eye_array(10_000_000)),
        r"the stiffness is sparse of shape \(10000000, 10000000\): .* GB are free; reduce the structure first",
    ),
    "structural damping given twice": (
        lambda: system(stiffness=(1 + 0.1j) * np.eye(2), structural_damping=np.eye(2)),
        r"the stiffness is complex, and structural_damping is given as well: remove one of them",
    ),
    "ragged mass": (
        lambda: system(mass=[[1, 0], [0]]),
        r"the mass: its rows have different lengths \[1, 2\], give as many numbers in each",
    ),
    "ragged harmonic force": (lambda: system(harmonic_force=[[0, 0], 1]), r"harmonic force: its rows have different"),
    "words in the harmonic force": (
        lambda: system(harmonic_force=[[0, 0], ["one", 0]]),
        r"the harmonic force holds 'one' at \(1, 0\): give numbers",
    ),
    "one joint for a list": (lambda: system(joints=contact()), r"joints are one joint, 'rub': give a list"),
    "a row for a joint": (lambda: system(joints=[contact(), X]), r"joint 1 is a ndarray: give a contact"),
    "complex row": (lambda: contact(normal=[0, 1j]), r'"rub": its normal holds 0\+1j at 1: give real numbers'),
    "ragged tangents": (lambda: contact(tangents=[[1, 0], [1]]), r"its tangents: its rows have different lengths"),
    "a normal of two dimensions": (
        lambda: contact(normal=[[0, 1]]),
        r'"rub": its normal has shape \(1, 2\), give one row',
    ),
    "stiffness in words": (
        lambda: contact(normal_stiffness="stiff"),
        r"\"rub\": normal_stiffness = 'stiff' must be a real number",
    ),
    "complex cubic spring": (
        lambda: CubicSpring(name="c", direction=X, stiffness=1j),  # type: ignore[arg-type]
        r'"c": stiffness = 1j must be a real number',
    ),
    "friction in words": (
        lambda: contact(friction="coulomb"),
        r"friction = 'coulomb' must be Friction\.UNCOUPLED or Friction\.COULOMB",
    ),
    "NaN in the static load": (
        lambda: system(static_load=[0, np.nan]),
        r"static load holds nan at 1: give finite numbers",
    ),
    "NaN in the harmonic force": (
        lambda: system(harmonic_force=[[0, 0], [0, 0], [np.nan, 0]]),
        r"harmonic force holds .*nan.* at \(2, 0\): give finite numbers",
    ),
    "a constant in the harmonic force": (
        lambda: system(harmonic_force=[[0, 7.5], [1, 0]]),
        r"7\.5\S* N in row 0 on degree of freedom 1",
    ),
    "static load of another size": (lambda: system(static_load=[1, 2, 3]), r"static load has shape \(3,\)"),
    "harmonic force of another size": (lambda: system(harmonic_force=[0, 1]), r"harmonic force has shape \(2,\)"),
    "two joints of one name": (lambda: system(joints=[contact(), contact()]), r'two joints are called "rub"'),
    "a joint on another structure": (
        lambda: system(joints=[CubicSpring(name="c", direction=np.eye(3)[0], stiffness=1)]),
        r'"c" acts on 3 degrees of freedom, the structure has 2',
    ),
    "contact DOF out of range": (lambda: along(2, {5: 1.0}), r"degree of freedom 5 does not exist.* 0 to 1"),
    "half a DOF": (lambda: along(2, {1.5: 1.0}), r"degree of freedom = 1\.5 must be a whole number"),  # type: ignore[dict-item]
    "weight of NaN": (lambda: along(2, {1: np.nan}), r"weight of degree of freedom 1 = nan must be a finite number"),
    "weight in words": (
        lambda: along(2, {1: "1"}),  # type: ignore[dict-item]
        r"weight of degree of freedom 1 = '1' must be a real number",
    ),
    "a DOF for weights": (lambda: along(2, 1), r"the weights are a int: give a mapping"),  # type: ignore[arg-type]
    "a structure of half a DOF": (lambda: along(2.5, {1: 1.0}), r"n_dof = 2\.5 must be a whole number"),  # type: ignore[arg-type]
    "a structure without DOF": (lambda: along(0, {}), r"n_dof = 0 must be positive"),
    "negative DOF": (lambda: between(2, -1), r"degree of freedom -1 does not exist"),
    "relative to itself": (lambda: between(2, 1, 1), r"degree of freedom 1 does not move relative to itself"),
    "negative tangential stiffness": (
        lambda: contact(tangential_stiffness=-3.0),
        r'"rub": tangential_stiffness = -3 must be positive',
    ),
    "no normal stiffness": (lambda: contact(normal_stiffness=0.0), r"normal_stiffness = 0 must be positive"),
    "mu in percent": (
        lambda: contact(friction_coefficient=40),
        r"friction_coefficient = 40 is beyond that of any two solids \(0 to 10\): divide it by 100 if it is in percent",
    ),
    "negative mu": (lambda: contact(friction_coefficient=-0.1), r"friction_coefficient = -0\.1 must not be negative"),
    "infinite preload": (lambda: contact(preload=np.inf), r"preload = inf must be a finite number"),
    "NaN in the gap": (lambda: contact(gap=np.nan), r"gap = nan must be a finite number"),
    "three tangents": (lambda: contact(tangents=np.ones((3, 2))), r"tangents of shape \(3, 2\)"),
    "tangents over another structure": (
        lambda: contact(tangents=np.ones((1, 3))),
        r"normal over 2 degrees of freedom but tangents over 3",
    ),
    "a row of zeros": (lambda: contact(normal=[0, 0]), r"its normal must hold finite numbers, not all of them zero"),
    "Jenkins element of negative limit": (
        lambda: JenkinsElement(name="j", direction=X, tangential_stiffness=1, limit_force=-2),
        r"limit_force = -2 must not be negative",
    ),
    "Jenkins element without stiffness": (
        lambda: JenkinsElement(name="j", direction=X, tangential_stiffness=0, limit_force=1),
        r"tangential_stiffness = 0 must be positive",
    ),
    "cubic spring of NaN": (
        lambda: CubicSpring(name="c", direction=X, stiffness=np.nan),
        r"stiffness = nan must be a finite number",
    ),
    "soft stop": (lambda: ElasticStop(name="s", direction=X, stiffness=-1), r"stiffness = -1 must be positive"),
    "negative drag": (
        lambda: QuadraticDamper(name="d", direction=X, damping=-0.5),
        r"damping = -0\.5 must not be negative",
    ),
}

MODEL: dict[str, tuple[Refused, str]] = {
    "indefinite mass": (lambda: balance(mass=np.diag([1.0, -2.0])), r"mass must be positive definite"),
    "mass that is not symmetric": (
        lambda: balance(mass=[[1.0, 0.5], [0.0, 1.0]]),
        r"mass is not symmetric: entries \(0, 1\) and \(1, 0\) are 0\.5 and 0",
    ),
    "NaN in the mass": (lambda: balance(mass=np.diag([1.0, np.nan])), r"mass holds nan at \(1, 1\)"),
    "negative stiffness": (
        lambda: balance(stiffness=-4 * np.eye(2), joints=()),
        r"stiffness is indefinite: lowest eigenvalue -4 ",
    ),
    "a body that nothing holds": (
        lambda: balance(stiffness=np.diag([1.0, 0.0]), joints=()),
        r"leaves 1 rigid-body motions free",
    ),
}

BALANCE: dict[str, tuple[Refused, str]] = {
    "H = 0 with a harmonic load": (lambda: balance(1), r"H = 0\) cannot hold a force in harmonic 1"),
    "no harmonics": (lambda: balance(0), r"n_harmonic = 0"),
    "a force beyond H": (
        lambda: balance(2, harmonic_force=[[0, 0], [0, 0], [0, 0], [1, 0]]),
        r"n_harmonic = 2 .*force in harmonic 3: take at least n_harmonic = 4",
    ),
    "no system": (
        lambda: HarmonicBalance(system=None, n_harmonic=4),  # type: ignore[arg-type]
        r"the system is a NoneType: give a JointedSystem",
    ),
    "too few samples": (
        lambda: HarmonicBalance(system=system(), n_harmonic=6, n_sample=20),
        r"n_sample = 20 is too few for H = 5.* 21",
    ),
    "more than memory": (
        lambda: HarmonicBalance(system=system(), n_harmonic=20_001, n_sample=10_000_000),
        r"H = 20000 with 10000000 samples .* GB of memory, but .* take fewer harmonics or samples",
    ),
    "fewer samples later": (lambda: balance(6).with_samples(8), r"n_sample = 8 is too few"),
    "level": (lambda: balance().at_level(np.nan), r"level = nan must be a finite number"),
    "endless level": (lambda: balance().at_level(1e300), r"level = 1e\+300 of a harmonic force of 0\.2 N.* 1e\+100 N"),
    "a level sweep without end": (lambda: level_response(balance(), 1.0, 1.0, 1e300), r"level = 1e\+300 of a harmonic"),
    "endless harmonic force": (
        lambda: balance(harmonic_force=[[0, 0], [1e200, 0]]),
        r"level = 1 of a harmonic force of 1e\+200 N, .* give smaller loads",
    ),
    "endless static load": (lambda: balance(static_load=[0, -1e200]), r"a static load of 1e\+200 N"),
    "endless motion": (
        lambda: steady_state(
            balance(
                mass=1e-80 * np.eye(2),
                damping=1e-80 * np.eye(2),
                stiffness=1e-80 * np.eye(2),
                joints=[CubicSpring(name="cubic", direction=X, stiffness=0.1)],
            ).at_level(1e90),
            0.5,
        ),
        r"the linear motion at 0\.0795775 Hz, level 1e\+90, is too large for double precision",
    ),
    "frequency 0": (lambda: steady_state(balance(), 0.0), r"angular_frequency = 0 rad/s must be positive"),
    "endless frequency": (
        lambda: frequency_response(balance(), 0.5, 1e300),
        r"angular_frequency = 1e\+300 rad/s must be below 1e\+50 rad/s",
    ),
    "frequency of NaN": (lambda: steady_state(balance(), np.nan), r"angular_frequency = nan rad/s"),
    "two sliders for one": (
        lambda: steady_state(balance(), 1.0, slider=[0.1, 0.2]),
        r"slider has shape \(2,\): give \(1,\), one number per tangent",
    ),
    "no sliders for one": (lambda: steady_state(balance(), 1.0, slider=[]), r"slider has shape \(0,\): give \(1,\)"),
    "a column of sliders": (lambda: steady_state(balance(), 1.0, slider=[[0.1]]), r"slider has shape \(1, 1\)"),  # type: ignore[list-item]
    "ragged sliders": (
        lambda: steady_state(balance(), 1.0, slider=[0.1, [0.1, 0.2]]),  # type: ignore[list-item]
        r"slider: its rows have different lengths \[1, 2\]",
    ),
    "a complex slider": (
        lambda: steady_state(balance(), 1.0, slider=[1j]),  # type: ignore[list-item]
        r"slider holds 0\+1j at 0: give real numbers",
    ),
    "NaN in a slider": (lambda: steady_state(balance(), 1.0, slider=[np.nan]), r"slider holds nan at 0"),
    "a start of too few harmonics": (
        lambda: steady_state(balance(), 1.0, start=np.zeros((3, 5))),
        r"start has shape \(3, 5\): give \(3, 7\), real coefficients of the directions",
    ),
    "a start of all degrees of freedom": (
        lambda: steady_state(balance(), 1.0, start=np.zeros((4, 2))),
        r"start has shape \(4, 2\): give \(3, 7\)",
    ),
    "a complex start": (
        lambda: steady_state(balance(), 1.0, start=1j * np.ones((3, 7))),  # type: ignore[arg-type]
        r"the start holds 0\+1j at \(0, 0\): give real numbers",
    ),
    "NaN in the start": (
        lambda: steady_state(balance(), 1.0, start=np.full((3, 7), np.nan)),
        r"the start holds nan at \(0, 0\): give finite numbers",
    ),
    "a start in words": (
        lambda: steady_state(balance(), 1.0, start="rest"),  # type: ignore[arg-type]
        r"the start holds 'rest': give numbers",
    ),
    "a state of other harmonics": (
        lambda: steady_state(balance(5), 1.0, start=steady_state(balance(4), 1.0)),
        r"state with displacement of shape \(4, 3\), the balance has 5 harmonics with the mean and 3 directions",
    ),
    "a branch from a start of another shape": (
        lambda: begin(Continuation(path=FrequencyPath(balance=balance()), first=1.0, last=2.0), np.zeros((2, 7))),
        r"start has shape \(2, 7\): give \(3, 7\)",
    ),
    "a point that a branch does not have": (
        lambda: frequency_response(balance(), 0.5, 0.6).start(balance(), 10**6),
        r"there is no point 1000000: the branch has \d+, give 0 to",
    ),
    "half a point of a branch": (
        lambda: frequency_response(balance(), 0.5, 0.6).start(balance(), 0.5),  # type: ignore[arg-type]
        r"index = 0\.5 must be a whole number",
    ),
    "a point of a branch of another structure": (
        lambda: frequency_response(duffing(), 0.5, 0.6).start(balance(), 0),
        r"branch has 1 degrees of freedom, the balance 2",
    ),
    "multiplier above 1": (
        lambda: steady_state(balance(), 1.0, slider=[-1.25], multiplier=True),
        r"multiplier -1\.25 is outside \[-1, 1\]",
    ),
    "empty range": (lambda: frequency_response(balance(), 2.0, 2.0), r"range from 2 to 2 is empty"),
    "range to NaN": (lambda: level_response(balance(), 1.0, 1.0, np.nan), r"range from 1 to nan is empty"),
    "endless step": (lambda: frequency_response(balance(), 1.0, 2.0, step=np.inf), r"step = inf must be positive"),
    "end of a range": (lambda: frequency_response(balance(), 1.0, "2"), r"last = '2' must be a real number"),  # type: ignore[arg-type]
    "step": (lambda: frequency_response(balance(), 1.0, 2.0, step=-0.5), r"step = -0\.5 must be positive"),
    "unknown joint": (
        lambda: joint_response(balance(), 1.0, "rubb", "gap", 0, 1),
        r'no joint "rubb": the system has rub, cubic',
    ),
    "unknown parameter": (
        lambda: joint_response(balance(), 1.0, "rub", "stiffness", 0, 1),
        r'"rub" has no parameter "stiffness": it has tangential_stiffness, normal_stiffness, friction_coefficient',
    ),
    "negative friction at the end of a branch": (
        lambda: joint_response(balance(), 1.0, "rub", "friction_coefficient", 0.4, -0.1),
        r'"rub": friction_coefficient = -0\.1 must not be negative all along its branch',
    ),
    "branch to a mu in percent": (
        lambda: joint_response(balance(), 1.0, "rub", "friction_coefficient", 0.4, 40),
        r"friction_coefficient = 40 is beyond that of any two solids .* all along its branch",
    ),
    "no stiffness at the beginning of a branch": (
        lambda: joint_response(balance(), 1.0, "rub", "normal_stiffness", 0.0, 2.0),
        r'"rub": normal_stiffness = 0 must be positive all along its branch',
    ),
    "infinite parameter at the end of a branch": (
        lambda: JointPath(balance=balance(), angular_frequency=1.0, joint="cubic", parameter="stiffness").at(np.inf),
        r'"cubic": stiffness = inf must be a finite number',
    ),
    "harmonics that are no whole number": (
        lambda: HarmonicBalance(system=system(), n_harmonic=5.0),  # type: ignore[arg-type]
        r"n_harmonic = 5\.0 must be a whole number: give an int",
    ),
    "harmonics in words": (
        lambda: HarmonicBalance(system=system(), n_harmonic="5"),  # type: ignore[arg-type]
        r"n_harmonic = '5' must be a whole number",
    ),
    "a truth value of harmonics": (
        lambda: HarmonicBalance(system=system(), n_harmonic=True),
        r"n_harmonic = True must be a whole number",
    ),
    "samples that are no whole number": (
        lambda: HarmonicBalance(system=system(), n_harmonic=4, n_sample=128.0),  # type: ignore[arg-type]
        r"n_sample = 128\.0 must be a whole number",
    ),
    "more samples that are no whole number": (
        lambda: balance().with_samples(np.float64(256)),  # type: ignore[arg-type]
        r"n_sample = np\.float64\(256\.0\) must be a whole number",
    ),
    "level in words": (
        lambda: HarmonicBalance(system=system(), n_harmonic=4, level="1"),  # type: ignore[arg-type]
        r"level = '1' must be a real number",
    ),
    "complex level": (lambda: balance().at_level(1j), r"level = 1j must be a real number"),  # type: ignore[arg-type]
    "frequency in words": (
        lambda: steady_state(balance(), "1"),  # type: ignore[arg-type]
        r"angular_frequency = '1' must be a real number",
    ),
    "several frequencies": (
        lambda: steady_state(balance(), np.array([1.0, 2.0])),  # type: ignore[arg-type]
        r"angular_frequency = array\(\[1\., 2\.\]\) must be a real number",
    ),
    "sensitivity to an unknown joint": (
        lambda: derivative(JointParameter(joint="nut", name="gap")),
        r'no joint "nut"',
    ),
    "sensitivity to an unknown slider": (lambda: derivative(SliderParameter(slider=1)), r"no slider 1: .* has 1"),
    "sensitivity to a harmonic beyond H": (
        lambda: derivative(LoadParameter(row=X, harmonic=4)),
        r"harmonic 4 is not between 0 and 3",
    ),
    "sensitivity to an unknown parameter": (
        lambda: derivative(JointParameter(joint="cubic", name="gap")),
        r'"cubic" has no parameter "gap": it has stiffness',
    ),
    "sensitivity to half a slider": (
        lambda: derivative(SliderParameter(slider=0.5)),  # type: ignore[arg-type]
        r"slider = 0\.5 must be a whole number",
    ),
    "sensitivity to half a harmonic": (
        lambda: derivative(LoadParameter(row=X, harmonic=1.5)),  # type: ignore[arg-type]
        r"harmonic = 1\.5 must be a whole number",
    ),
    "sensitivity to a load over another structure": (
        lambda: derivative(LoadParameter(row=np.ones(3))),
        r"row of a load parameter has shape \(3,\): give \(2,\)",
    ),
    "sensitivity to a load on a number": (
        lambda: derivative(LoadParameter(row=1)),  # type: ignore[arg-type]
        r"row of a load parameter has shape \(\): give \(2,\)",
    ),
    "sensitivity to a load of NaN": (
        lambda: derivative(LoadParameter(row=np.array([0, np.nan]))),
        r"row of a load parameter holds nan at 1: give finite numbers",
    ),
    "sensitivity to a complex load": (
        lambda: derivative(LoadParameter(row=np.array([0, 2j]))),
        r"row of a load parameter holds 0\+2j at 1: give real numbers",
    ),
    "sensitivity to a load without a phase": (
        lambda: derivative(LoadParameter(row=X, phase=np.inf)),
        r"phase = inf must be a finite number",
    ),
    "sensitivity to a mass over another structure": (
        lambda: derivative(point_mass(np.ones(3))),
        r"mass of a matrix parameter has shape \(3, 3\): give \(2, 2\)",
    ),
    "sensitivity to a row for a stiffness": (
        lambda: derivative(MatrixParameter(stiffness=X)),
        r"stiffness of a matrix parameter has shape \(2,\): give \(2, 2\)",
    ),
    "sensitivity to an infinite damping": (
        lambda: derivative(MatrixParameter(damping=np.diag([1, np.inf]))),
        r"damping of a matrix parameter holds inf at \(1, 1\): give finite numbers",
    ),
    "sensitivity to a word": (
        lambda: derivative("gap"),  # type: ignore[arg-type]
        r"'gap' is not a parameter: give a JointParameter",
    ),
    "one parameter for a list": (
        lambda: sensitivity(balance(), steady_state(balance(), 0.5), LevelParameter()),  # type: ignore[arg-type]
        r"parameters are one LevelParameter: give a list",
    ),
    "another matrix": (lambda: scaled(balance(), "inertia"), r'no matrix "inertia" to scale'),
    "missing file": (lambda: load_branch(Path("nowhere.nc")), r'"nowhere\.nc" contains no response branch'),
}


OF_A_STATE: dict[str, Callable[[HarmonicBalance, SteadyState], object]] = {
    "contact motion": contact_motion,
    "contact share": contact_share,
    "energy balance": energy_balance,
    "truncation": truncation,
    "sensitivity": lambda of, state: sensitivity(of, state, [LevelParameter()]),
}

OTHER_BALANCES: dict[str, tuple[Callable[[], HarmonicBalance], str]] = {
    "other harmonics": (lambda: balance(4), r"state has coefficients of shape \(4, 2\), the balance \(5, 2\)"),
    "another system": (duffing, r"state has coefficients of shape \(2, 1\), the balance \(5, 2\)"),
    "other joints": (
        lambda: balance(5, joints=[contact()]),
        r"state has displacement of shape \(5, 2\), the balance \(5, 3\): give the balance with which",
    ),
    "other sliders": (
        lambda: balance(5, joints=[contact(tangents=np.eye(2)), CubicSpring(name="cubic", direction=X, stiffness=1)]),
        r"state has displacement of shape \(5, 4\), the balance \(5, 3\)",
    ),
    "springs in place of sliders": (
        lambda: balance(5, joints=[CubicSpring(name=name, direction=X, stiffness=0.1) for name in "abc"]),
        r"state has initial_slider of shape \(0,\), the balance \(1,\)",
    ),
}


#: Row, harmonic and derivative of an output.
OUTPUTS: dict[str, tuple[tuple[object, ...], str]] = {
    "a degree of freedom beyond the last": ((2,), r"degree of freedom 2 does not exist: the structure has 0 to 1"),
    "a negative degree of freedom": ((-1,), r"degree of freedom -1 does not exist"),
    "half a degree of freedom": ((0.5,), r"row = 0\.5 must be a whole number"),
    "no row": ((None,), r"row = None must be a whole number"),
    "a name for a row": (("tip",), r"row = 'tip' must be a whole number"),
    "a row of another structure": ((np.ones(3),), r"the row has shape \(3,\): give \(2,\), one weight per degree"),
    "a row of rows": ((np.eye(2),), r"the row has shape \(2, 2\)"),
    "a row of NaN": (([0, np.nan],), r"the row holds nan at 1: give finite numbers"),
    "a complex row": (([0, 1j],), r"the row holds 0\+1j at 1: give real numbers"),
    "a harmonic beyond H": ((0, 4), r"harmonic 4 is not between 0 and 3"),
    "a negative harmonic": ((0, -1), r"harmonic -1 is not between 0 and 3"),
    "half a harmonic": ((0, 1.5), r"harmonic = 1\.5 must be a whole number"),
    "a third derivative": ((0, 1, 3), r"derivative = 3 must be 0, 1 or 2"),
    "half a derivative": ((0, 1, 0.5), r"derivative = 0\.5 must be a whole number"),
}


def derivative(parameter: Parameter) -> object:
    of = balance()
    return sensitivity(of, steady_state(of, 0.5), [parameter])


def check(error: type[InputError], refused: Refused, words: str) -> None:
    with pytest.raises(error, match=words) as caught:
        refused()
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 300


@pytest.mark.parametrize("case", DATA)
def test_data_that_describe_no_jointed_system_are_refused(case: str) -> None:
    check(JointError, *DATA[case])


@pytest.mark.parametrize("case", MODEL)
def test_matrices_of_no_vibrating_structure_are_refused(case: str) -> None:
    check(ModelError, *MODEL[case])


@pytest.mark.parametrize("case", BALANCE)
def test_harmonics_starts_and_ranges_that_cannot_be_used_are_refused(case: str) -> None:
    check(BalanceError, *BALANCE[case])


@pytest.mark.parametrize("case", OTHER_BALANCES)
@pytest.mark.parametrize("what", OF_A_STATE)
def test_a_state_of_another_balance_is_refused(what: str, case: str) -> None:
    found_with, words = OTHER_BALANCES[case]
    state = steady_state(found_with(), 0.5)
    check(BalanceError, lambda: OF_A_STATE[what](balance(5), state), words)


@pytest.mark.parametrize("case", OUTPUTS)
def test_outputs_that_a_solution_does_not_have_are_refused(case: str) -> None:
    given, words = OUTPUTS[case]
    state = steady_state(balance(), 0.5)
    branch = make_branch([balance()], [state], StopReason.SOLVED)
    check(BalanceError, lambda: branch.output(*given), words)  # type: ignore[arg-type]
    check(BalanceError, lambda: branch.amplitude(*given), words)  # type: ignore[arg-type]
    if len(given) < 3:
        check(BalanceError, lambda: state.amplitude(*given), words)  # type: ignore[arg-type]


def test_what_is_no_state_is_refused() -> None:
    coefficients = steady_state(balance(), 0.5).coefficients
    check(BalanceError, lambda: contact_motion(balance(), coefficients), r"the state is a ndarray: give one that")  # type: ignore[arg-type]


@pytest.mark.parametrize("slider", [None, [0.1]])
def test_where_nothing_converges_the_message_says_what_to_try(
    slider: list[float] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stuck(*given: object) -> tuple[object, float, int]:
        return given[3], 1.0, 0

    for package in (hbsolve.solution, hbsolve.steady_state):
        monkeypatch.setattr(package, "newton_at", stuck)
    advice = r"motion; start from a neighbouring state, or continue a branch to here$"
    with pytest.raises(NoSteadyState, match=advice) as caught:
        steady_state(balance(joints=[contact()]), 0.5, slider=slider)
    assert re.match(r"no steady state was found at 0\.0795775 Hz, level 1: ", str(caught.value))


def test_sliders_are_advised_where_those_of_the_static_load_lead_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def only_with_sliders(*given: object) -> tuple[object, float, int]:
        at_rest = np.array_equal(given[2], made.linear(made.at(0.5), 0.0))
        return given[3], 0.0 if at_rest or np.any(given[4].value) else 1.0, 0  # type: ignore[attr-defined]

    # The load moves the contact by more than its spring holds: the slider is dragged.
    made = balance(joints=[contact()], static_load=[5.0, 0.0])
    for package in (hbsolve.solution, hbsolve.steady_state):
        monkeypatch.setattr(package, "newton_at", only_with_sliders)
    with pytest.raises(NoSteadyState, match="give `slider`") as caught:
        steady_state(made, 0.5)
    assert caught.value.failure is Failure.SLIDERS_UNSET


def test_a_ramp_that_ends_below_the_level_has_no_residual_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def found_at_rest(*given: object) -> tuple[object, float, int]:
        return given[3], 1.0 if np.any(given[2] != at_rest) else 0.0, 0

    made = balance()
    at_rest = made.linear(made.at(0.5), 0.0)
    for package in (hbsolve.solution, hbsolve.steady_state):
        monkeypatch.setattr(package, "newton_at", found_at_rest)
    with pytest.raises(NoSteadyState, match="a ramp of the level stopped below this level"):
        steady_state(made, 0.5)


ROTATED = np.array([[0.8, -0.6], [0.6, 0.8]])


@pytest.mark.parametrize(
    ("damping", "lowest"),
    [
        (-np.eye(2), "-1"),
        (np.diag([1.0, -1e-8]), "-1e-08"),
        (np.array([[0.0, 0.5], [0.5, 0.0]]), "-0.5"),
        (ROTATED @ np.diag([2.0, -0.1]) @ ROTATED.T, "-0.1"),
        (np.array([[1.0, 3.0], [1.0, 1.0]]), "-1"),  # whose own eigenvalues are 2.7 and -0.7
    ],
)
def test_damping_that_puts_energy_in_is_told(damping: NDArray[np.float64], lowest: str) -> None:
    with pytest.warns(DampingWarning, match=f"has the eigenvalue {lowest} N s/m.* check its sign") as caught:
        balance(damping=damping).at_level(2.0)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert "\n" not in str(caught[0].message)


@pytest.mark.parametrize(
    "damping",
    [
        np.zeros((2, 2)),
        np.diag([1.0, 0.0]),
        np.diag([1.0, -1e-12]),
        ROTATED @ np.diag([1e9, 0.0]) @ ROTATED.T,
        np.array([[0.0, 3.0], [-3.0, 0.0]]),  # gyroscopic
        np.array([[-1e-15, 3.0], [-3.0, 0.0]]),
    ],
)
def test_damping_that_takes_energy_or_none_is_not(
    damping: NDArray[np.float64], recwarn: pytest.WarningsRecorder
) -> None:
    assert balance(damping=damping).n_harmonic == 4
    assert not [item for item in recwarn if issubclass(item.category, DampingWarning)]


def test_a_complex_array_without_imaginary_parts_loses_nothing() -> None:
    made = system(mass=np.eye(2, dtype=complex), static_load=np.array([1, 2], dtype=object))
    np.testing.assert_array_equal(made.mass, np.eye(2))
    np.testing.assert_array_equal(made.static, [1, 2])


def test_numbers_of_numpy_count_as_well() -> None:
    made = HarmonicBalance(system=system(), n_harmonic=np.int64(4), n_sample=np.uint8(128), level=np.float32(0.5))  # type: ignore[arg-type]
    assert [type(item) for item in (made.n_harmonic, made.n_sample, made.level)] == [int, int, float]
    at = np.array(0.5)
    assert steady_state(made, at).residual_norm < 1e-9  # type: ignore[arg-type]


def test_a_branch_may_end_at_the_edge_of_what_a_joint_can_have() -> None:
    branch = joint_response(balance(), 0.5, "rub", "friction_coefficient", 0.4, 0.0)
    assert branch.stop_reason is StopReason.REACHED
    # Without friction the tangent is free: a spring of no force, and the cubic one.
    free = steady_state(balance(joints=[CubicSpring(name="cubic", direction=X, stiffness=0.1)]), 0.5)
    np.testing.assert_allclose(branch.coefficients[-1][:, 0], free.coefficients[:, 0], atol=1e-8)  # residual 1e-9


def test_a_motion_whose_squares_vanish_is_left_as_it_is() -> None:
    branch = frequency_response(balance(joints=[contact(preload=0.0)]).at_level(1e-200), 0.5, 0.6, step=1e300)
    assert branch.stop_reason is StopReason.REACHED
    np.testing.assert_array_equal(branch.truncation_error, 0)


def test_what_the_cases_start_from_is_accepted() -> None:
    """Else each of them might be refused for another reason."""
    assert steady_state(balance(), 0.5, slider=[0.5], multiplier=True).residual_norm < 1e-9
    held = balance(stiffness=np.diag([1.0, 0.0]))  # by its contact
    assert steady_state(held, 0.5).residual_norm < 1e-9
    static = replace(system(), harmonic_force=None, static_load=np.array([0.1, 0.2]))
    assert steady_state(HarmonicBalance(system=static, n_harmonic=1), 0.5).residual_norm < 1e-9
