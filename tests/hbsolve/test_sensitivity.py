"""Derivatives of steady states against central differences of states that are solved again."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.model_rates import MatrixParameter
from hbsolve.sensitivity import (
    FrequencyParameter,
    JointParameter,
    LevelParameter,
    LoadParameter,
    Parameter,
    SliderParameter,
    damper,
    point_mass,
    scaled,
    sensitivity,
    spring,
)
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    JointedSystem,
    QuadraticDamper,
    along,
    between,
)

OMEGA, N = 9.0, 5
#: Sliders at the start: those of contacts that slip are forgotten, that of "held" is not.
SLIDER = np.array([0.0, 0.0, 0.0, 0.0, 0.003])


def system(damping: str = "coupled") -> JointedSystem:
    stiffness = 100 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
    joints = [
        FrictionContact(
            name="rub",
            normal=between(N, 1, 0),
            tangents=along(N, {2: 1.0}),
            normal_stiffness=60.0,
            tangential_stiffness=50.0,
            friction_coefficient=0.3,
            preload=1.0,
            gap=0.001,
        ),
        FrictionContact(
            name="pad",
            normal=along(N, {1: -1.0}),
            tangents=np.vstack([along(N, {2: 1.0}), along(N, {3: 0.8, 4: 0.6})]),
            normal_stiffness=40.0,
            tangential_stiffness=30.0,
            friction_coefficient=0.4,
            preload=0.8,
            friction=Friction.COULOMB,
        ),
        JenkinsElement(name="slider", direction=between(N, 4, 3), tangential_stiffness=30.0, limit_force=0.4),
        JenkinsElement(name="held", direction=along(N, {0: 1.0}), tangential_stiffness=20.0, limit_force=50.0),
        CubicSpring(name="cubic", direction=along(N, {0: 1.0}), stiffness=200.0),
        ElasticStop(name="stop", direction=along(N, {4: 1.0}), stiffness=80.0, gap=0.02),
        QuadraticDamper(name="drag", direction=along(N, {2: 1.0}), damping=0.5),
    ]
    force = np.zeros((3, N), dtype=complex)
    force[1, 4], force[2, 1] = 3.0 - 1.0j, 0.5j
    mass = np.diag([1.0, 1.5, 1.0, 0.8, 1.2])
    return JointedSystem(
        mass=mass,
        damping=np.diag([0.1, 0.9, 0.2, 0.5, 0.3]) if damping == "coupled" else 0.1 * mass + 1e-3 * stiffness,
        stiffness=stiffness,
        joints=joints,
        static_load=along(N, {0: 0.3}),
        harmonic_force=force,
    )


def balance_of(of: JointedSystem) -> HarmonicBalance:
    return HarmonicBalance(system=of, n_harmonic=4, n_sample=256)


def solved(balance: HarmonicBalance, near: SteadyState, omega: float = OMEGA, slider: object = SLIDER) -> SteadyState:
    return steady_state(balance, omega, start=near, slider=slider)  # type: ignore[arg-type]


Change = Callable[[JointedSystem, float], JointedSystem]
ROW = along(N, {1: 0.6, 3: -0.8})
LAST = along(N, {4: 1.0})


def matrix(name: str, row: NDArray[np.float64]) -> Change:
    return lambda s, h: replace(s, **{name: getattr(s, name) + h * np.outer(row, row)})


def factor(*names: str) -> Change:
    return lambda s, h: replace(s, **{name: (1 + h) * getattr(s, name) for name in names})


def joint(name: str, parameter: str) -> Change:
    def change(s: JointedSystem, h: float) -> JointedSystem:
        changed = [
            replace(item, **{parameter: getattr(item, parameter) + h}) if item.name == name else item
            for item in s.joints
        ]
        return replace(s, joints=changed)

    return change


def load(harmonic: int, phase: float) -> Change:
    def change(s: JointedSystem, h: float) -> JointedSystem:
        if not harmonic:
            return replace(s, static_load=s.static + h * ROW)
        force = np.array(s.dynamic)
        force = np.vstack([force, np.zeros((4 - len(force), N))])
        force[harmonic] += h * np.exp(1j * phase) * ROW
        return replace(s, harmonic_force=force)

    return change


JOINTS = {
    "rub": ("tangential_stiffness", "normal_stiffness", "friction_coefficient", "preload", "gap"),
    "pad": ("tangential_stiffness", "normal_stiffness", "friction_coefficient", "preload", "gap"),
    "slider": ("tangential_stiffness", "limit_force"),
    "held": ("tangential_stiffness",),
    "cubic": ("stiffness",),
    "stop": ("stiffness", "gap"),
    "drag": ("damping",),
}
#: Parameter, how a system changes with it, and the step of the differences.
SYSTEM: dict[str, tuple[Parameter, Change, float]] = {
    **{
        f"{name}.{each}": (
            JointParameter(joint=name, name=each),
            joint(name, each),
            1e-6 if each == "gap" else 1e-5 if each in {"friction_coefficient", "preload", "limit_force"} else 1e-3,
        )
        for name, names in JOINTS.items()
        for each in names
    },
    "point mass": (point_mass(ROW), matrix("mass", ROW), 1e-5),
    "spring": (spring(ROW), matrix("stiffness", ROW), 1e-3),
    "damper": (damper(ROW), matrix("damping", ROW), 1e-4),
    "load": (LoadParameter(row=ROW), load(1, 0.0), 1e-4),
    "third harmonic of a load": (LoadParameter(row=ROW, harmonic=3, phase=0.7), load(3, 0.7), 1e-4),
    "static load": (LoadParameter(row=ROW, harmonic=0, phase=0.7), load(0, 0.0), 1e-4),
    "scaled mass": (scaled(balance_of(system()), "mass"), factor("mass"), 1e-6),
    "Young's modulus": (
        scaled(balance_of(system()), "stiffness", "damping"),
        factor("stiffness", "damping"),
        1e-6,
    ),
    "mass and stiffness": (
        MatrixParameter(mass=np.outer(LAST, LAST), stiffness=30 * np.outer(ROW, ROW)),
        lambda s, h: matrix("stiffness", np.sqrt(30) * ROW)(matrix("mass", LAST)(s, h), h),
        1e-5,
    ),
}


@pytest.fixture(scope="module")
def base() -> tuple[HarmonicBalance, SteadyState]:
    balance = balance_of(system())
    return balance, steady_state(balance, OMEGA, slider=SLIDER)


def check(exact: NDArray[np.complex128], above: SteadyState, below: SteadyState, step: float) -> None:
    differences = (above.coefficients - below.coefficients) / (2 * step)
    # States are solved to 1e-9 of a motion of 0.05: over the steps, up to 1e-5 of each derivative.
    np.testing.assert_allclose(exact, differences, atol=1e-5 * np.abs(differences).max())


@pytest.mark.parametrize("case", SYSTEM)
def test_derivatives_by_a_parameter_of_the_system(case: str, base: tuple[HarmonicBalance, SteadyState]) -> None:
    parameter, change, step = SYSTEM[case]
    balance, state = base
    below, above = (solved(balance_of(change(system(), h)), state) for h in (-step, step))
    check(sensitivity(balance, state, [parameter])[0], above, below, step)


def test_derivatives_by_frequency_level_and_sliders(base: tuple[HarmonicBalance, SteadyState]) -> None:
    balance, state = base
    by_frequency, by_level, by_slider, forgotten = sensitivity(
        balance,
        state,
        [FrequencyParameter(), LevelParameter(), SliderParameter(slider=4), SliderParameter(slider=3)],
    )
    check(by_frequency, solved(balance, state, OMEGA + 1e-5), solved(balance, state, OMEGA - 1e-5), 1e-5)
    check(by_level, solved(balance.at_level(1 + 1e-5), state), solved(balance.at_level(1 - 1e-5), state), 1e-5)
    step = 1e-5 * np.eye(5)[4]
    check(by_slider, *(solved(balance, state, slider=SLIDER + h) for h in (step, -step)), 1e-5)
    assert np.abs(by_slider).max() > 1e-3
    assert not forgotten.any()  # it slips


def test_derivatives_by_a_multiplier() -> None:
    balance = balance_of(system())
    m = np.array([0.0, 0.0, 0.0, 0.0, 0.1])
    state = steady_state(balance, OMEGA, slider=m, multiplier=True)
    step = 1e-5 * np.eye(5)[4]
    above, below = (steady_state(balance, OMEGA, start=state, slider=m + h, multiplier=True) for h in (step, -step))
    check(sensitivity(balance, state, [SliderParameter(slider=4)])[0], above, below, 1e-5)


def test_the_level_of_the_state_counts_and_not_that_of_the_balance(base: tuple[HarmonicBalance, SteadyState]) -> None:
    balance, _ = base
    state = steady_state(balance.at_level(0.5), OMEGA, slider=SLIDER)
    parameters = [FrequencyParameter(), LevelParameter()]
    np.testing.assert_array_equal(
        sensitivity(balance, state, parameters), sensitivity(balance.at_level(0.5), state, parameters)
    )


@pytest.mark.parametrize("gap", [0.5, 0.02], ids=["open", "bouncing"])
@pytest.mark.parametrize("friction", list(Friction))
def test_a_contact_that_does_not_slide_yet_is_open_to_a_tangential_load(friction: Friction, gap: float) -> None:
    contact = FrictionContact(
        name="c", normal=np.eye(3)[2], tangents=np.eye(3)[:2], normal_stiffness=60.0, tangential_stiffness=50.0,
        friction_coefficient=0.4, gap=gap, friction=friction,
    )  # fmt: skip
    force = np.zeros((2, 3))
    force[1, 2] = 3.0
    bouncing = JointedSystem(
        mass=np.eye(3), damping=np.eye(3), stiffness=np.diag([100.0, 120.0, 110.0]), joints=[contact],
        harmonic_force=force,
    )  # fmt: skip
    state = steady_state(balance_of(bouncing), OMEGA)
    assert not state.coefficients[:, :2].any()
    (derivative,) = sensitivity(balance_of(bouncing), state, [LoadParameter(row=np.eye(3)[0])])
    step = 1e-6
    below, above = (
        steady_state(balance_of(replace(bouncing, harmonic_force=force + h * np.eye(3)[[1, 0]] * [[0], [1]])), OMEGA)
        for h in (-step, step)
    )
    check(derivative, above, below, step)
    if gap == 0.5:
        assert derivative[1, 0] == pytest.approx(1 / (100 - OMEGA**2 + 1j * OMEGA), rel=1e-9)  # no contact at all


def test_damping_of_the_free_structure_changes_nothing_in_the_method() -> None:
    balance = balance_of(system("of the free structure"))
    state = steady_state(balance, OMEGA, slider=SLIDER)
    for case in ("rub.friction_coefficient", "point mass", "load"):
        parameter, change, step = SYSTEM[case]
        below, above = (solved(balance_of(change(system("of the free structure"), h)), state) for h in (-step, step))
        check(sensitivity(balance, state, [parameter])[0], above, below, step)


def test_the_derivative_of_a_linear_oscillator_is_that_of_its_receptance() -> None:
    one, k, m, c, w = np.ones(1), 4.0, 1.0, 0.1, 1.7
    linear = JointedSystem(mass=[[m]], damping=[[c]], stiffness=[[k]], harmonic_force=[[0], [1]])
    balance = HarmonicBalance(system=linear, n_harmonic=2)
    state = steady_state(balance, w)
    parameters = [spring(one), point_mass(one), damper(one), FrequencyParameter(), LevelParameter()]
    alpha = 1 / (k - w**2 * m + 1j * w * c)
    exact = alpha**2 * np.array([-1, w**2, -1j * w, 2 * w * m - 1j * c, 1 / alpha])
    np.testing.assert_allclose(sensitivity(balance, state, parameters)[:, 1, 0], exact, rtol=1e-12)
