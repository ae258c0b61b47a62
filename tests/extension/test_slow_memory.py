"""Laws from outside whose memory fades slowly, never, or does not repeat."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import Failure, NoSteadyState
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.solution import recover_state
from hbsolve.state import make_initial_sliders
from hbsolve.steady_state import steady_state
from reduction.joint_law.registry import LAWS, Joint
from reduction.jointed_system import BoucWenJoint, JointedSystem
from tests.hbsolve import test_laws

LAW = """
from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LawParameter

STIFFNESS = LawParameter(name="stiffness", unit="N/m", meaning="k", typical=1e6, positive=True)
LIMIT = LawParameter(name="limit", unit="N", meaning="F", typical=10.0, positive=True)
FACTS = dict(
    parameters=[STIFFNESS, LIMIT], typical_displacement=3e-5, stuck_stiffness=lambda stiffness, limit: stiffness,
    energy=None,
)


@joint_law(kind="own hysteresis", n_state=2, **FACTS)
def hysteresis(u, velocity, state, parameters):
    k, limit = parameters
    z, before = state
    z = z + u - before - 0.5 * k / limit * (abs(u - before) * z + (u - before) * abs(z))
    return k * z, (z, u)


@joint_law(kind="hysteresis beside a slider", n_state=3, **FACTS)
def beside(u, velocity, state, parameters):
    k, limit = parameters
    z, before, w = state
    z = z + u - before - 0.5 * k / limit * (abs(u - before) * z + (u - before) * abs(z))
    w = min(max(w, u - 2 * limit / k), u + 2 * limit / k)
    return 0.5 * k * (z + u - w), (z, u, w)


@joint_law(kind="ratchet", n_state=1, **FACTS)
def ratchet(u, velocity, state, parameters):
    w = state[0] + 1e-3 * max(u, 0.0)
    return parameters[0] * u + parameters[1] * w / (1e-3 + abs(w)), (w,)
"""


@pytest.fixture(scope="module")
def laws(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, type[Joint]]]:
    file = tmp_path_factory.mktemp("laws") / "slow.py"
    file.write_text(LAW)
    yield {law.kind: law for law in LAWS.load(file)}
    LAWS.forget(file)


def oscillator(joint: Joint, force: float, static: float) -> JointedSystem:
    return JointedSystem(
        mass=[[1.0]], damping=[[10.0]], stiffness=[[1e4]], joints=[joint], static_load=[static],
        harmonic_force=[[0.0], [force]],
    )  # fmt: skip


def build(law: type[Joint]) -> Joint:
    return law.build("joint", {"direction": np.ones(1)}, {"stiffness": 5e3, "limit": 20.0})


@pytest.mark.parametrize("force", [3.0, 0.1, 1e-3])
def test_a_static_stretch_relaxes_however_slowly(laws: dict[str, type[Joint]], force: float) -> None:
    system = oscillator(build(laws["own hysteresis"]), force, 15.0)
    balance = HarmonicBalance(system=system, n_harmonic=4, n_sample=256)
    state = steady_state(balance, 90.0)
    # The loop of this law is point-symmetric about its middle, so that its mean force is zero.
    assert state.coefficients[0, 0].real == pytest.approx(15.0 / 1e4, rel=1e-8)
    built_in = BoucWenJoint(
        name="b", direction=np.ones(1), tangential_stiffness=5e3, limit_force=20.0, exponent=1.0, shape=0.5
    )
    expected = steady_state(HarmonicBalance(system=oscillator(built_in, force, 15.0), n_harmonic=4, n_sample=256), 90.0)
    # Euler's rule of the law from outside: first order in 256 steps.
    np.testing.assert_allclose(state.coefficients[1], expected.coefficients[1], rtol=1e-3)


def motion(size: float = 0.02) -> NDArray[np.float64]:
    """About a mean of twice the displacement at yield; by default far smaller than that."""
    x = size * np.random.default_rng(3).normal(size=(1, 2 * test_laws.N_HARMONIC - 1)) * 1e-4
    x[0, 0] = 2e-5
    return x


@pytest.mark.parametrize("kind", ["own hysteresis", "hysteresis beside a slider"])
def test_derivatives_of_a_slow_cycle_equal_differences(laws: dict[str, type[Joint]], kind: str) -> None:
    law = laws[kind]
    joint, x = law.build("joint", {"direction": np.ones(1)}, test_laws.typical(law)), motion()
    begin = np.array([0.0, 0.0, 3e-5])[: joint.n_slider]
    exact = test_laws.evaluated(x, joint, begin, want=PARAMETERS)
    assert not exact.unsettled.any()
    for column in range(x.shape[1]):
        unit = np.eye(x.shape[1])[[column]]
        test_laws.check_column(
            exact.jacobian[:1, :, column],
            lambda by, unit=unit: test_laws.evaluated(x + by * unit, joint, begin),  # type: ignore[misc]
            1e-10,
        )
    values = np.array(joint.parameter_values)
    for number in range(len(values)):
        unit = np.eye(len(values))[number]
        test_laws.check_column(
            exact.by_parameter[number, :1],
            lambda by, unit=unit: test_laws.evaluated(x, joint, begin, values + by * unit),  # type: ignore[misc]
            1e-5 * values[number],
        )
    for number in range(joint.n_slider):
        unit = np.eye(joint.n_slider)[number]
        test_laws.check_column(
            exact.by_start[number, :1],
            lambda by, unit=unit: test_laws.evaluated(x, joint, begin + by * unit),  # type: ignore[misc]
            1e-9,
        )
    if joint.n_slider == 3:
        assert (exact.slider[2] == begin[2]).all()  # a slider that sticks stays, beside a state that fades


def test_a_ratchet_has_no_steady_state(laws: dict[str, type[Joint]]) -> None:
    balance = HarmonicBalance(system=oscillator(build(laws["ratchet"]), 3.0, 0.0), n_harmonic=4, n_sample=256)
    x, sliders = np.full((1, 7), 1e-4), make_initial_sliders(balance, None)
    with pytest.raises(NoSteadyState, match=r'"joint" does not repeat every period') as refused:
        recover_state(balance, balance.at(90.0), x, sliders, 0.0, 0)
    assert refused.value.failure is Failure.MEMORY


@pytest.mark.parametrize(("kind", "unsettled"), [("ratchet", 1), ("own hysteresis", 0)])
def test_a_state_that_does_not_repeat_is_told(laws: dict[str, type[Joint]], kind: str, unsettled: int) -> None:
    law = laws[kind]
    joint = law.build("joint", {"direction": np.ones(1)}, test_laws.typical(law))
    (told,) = test_laws.evaluated(motion(1.0), joint, np.zeros(joint.n_slider)).unsettled
    assert told == unsettled
