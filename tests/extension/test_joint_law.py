"""A law with memory, a four-element Iwan chain, added by one file outside the product, passes what every law must."""

import pickle
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry.errors import RegistryError
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.response import frequency_response
from hbsolve.energy import energy_balance
from hbsolve.steady_state import steady_state
from reduction.joint_law.registry import LAWS, Joint
from reduction.jointed_system import CubicSpring, JenkinsChain, JenkinsElement, JointedSystem
from tests.hbsolve import test_laws
from tests.slow import slow
from transient.steady import steady_motion

IWAN = Path(__file__).with_name("iwan.py")
ONE = np.ones(1)


@pytest.fixture(scope="module")
def law() -> Iterator[type[Joint]]:
    """The chain; the other tests of this process do without it."""
    (chain,) = LAWS.load(IWAN)
    yield chain
    LAWS.forget(IWAN)


for _name, _test in list(vars(test_laws).items()):
    if _name.startswith("test_"):
        globals()[_name] = _test


def oscillator(*joints: Joint) -> JointedSystem:
    return JointedSystem(
        mass=[[1.0]], damping=[[20.0]], stiffness=[[1e6]], joints=joints, harmonic_force=[[0.0], [15.0]]
    )


def test_the_chain_is_four_jenkins_elements(law: type[Joint]) -> None:
    """Written as one law of a user's, or as four of the product's: the same motion, slider by slider."""
    chain = law.build("chain", {"direction": ONE}, {"stiffness": 1e6, "limit_force": 10.0})
    four = [
        JenkinsElement(name=f"{i}", direction=ONE, tangential_stiffness=2.5e5, limit_force=10.0 * (2 * i + 1) / 16)
        for i in range(4)
    ]
    motions = []
    for system in (oscillator(chain), oscillator(*four)):
        balance = HarmonicBalance(system=system, n_harmonic=8, n_sample=512)
        state = steady_state(balance, 1150.0)
        motions.append((balance, state))
    (one, state), (other, expected) = motions
    # Newton's method stops at 1e-9 of the linear motion.
    np.testing.assert_allclose(
        state.coefficients, expected.coefficients, atol=1e-8 * np.abs(expected.coefficients).max()
    )
    (together,) = contact_motion(one, state)
    apart = contact_motion(other, expected)
    np.testing.assert_allclose(together.force, sum(item.force for item in apart), atol=1e-6)
    np.testing.assert_allclose(together.slider, np.vstack([item.slider for item in apart]), atol=1e-12)
    assert 0 < together.share[1] < 1


def test_the_chain_slips_along_a_curve(law: type[Joint]) -> None:
    chain = law.build("chain", {"direction": ONE}, test_laws.typical(law))
    balance = HarmonicBalance(system=oscillator(chain), n_harmonic=6, n_sample=256)
    branch = frequency_response(balance, 1000.0, 1500.0)
    peak = branch.angular_frequency[np.abs(branch.coefficients[:, 1, 0]).argmax()]
    assert 1000.0 < peak < np.sqrt(2e6)  # softer than stuck


def test_a_balance_with_the_chain_works_in_another_process(law: type[Joint], tmp_path: Path) -> None:
    """The address of its machine code is of one process: another one compiles its own."""
    chain = law.build("chain", {"direction": ONE}, test_laws.typical(law))
    balance = HarmonicBalance(system=oscillator(chain), n_harmonic=4)
    file = tmp_path / "balance"
    file.write_bytes(pickle.dumps(balance))
    script = (
        f"import pickle, geometry.registry\nbalance = pickle.load(open({str(file)!r}, 'rb'))\n"
        "from hbsolve.steady_state import steady_state\nprint(repr(steady_state(balance, 1150.0).amplitude(0)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(steady_state(balance, 1150.0).amplitude(0), rel=1e-12)


HEAD = """
import random
from math import tanh
from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LawParameter
STIFFNESS = LawParameter(name="stiffness", unit="N/m", meaning="k", typical=1e4, positive=True)
FACTS = dict(
    kind="mine", parameters=[STIFFNESS], typical_displacement=1e-3, n_state=0, stuck_stiffness=lambda k: k, energy=None
)
"""


SLIDER = (
    HEAD
    + """
@joint_law(
    kind="own slider", n_state=1, typical_displacement=1e-3, stuck_stiffness=lambda k, limit: k, energy=None,
    parameters=[STIFFNESS, LawParameter(name="limit", unit="N", meaning="F", typical=10.0, positive=True)],
)
def slider(u, velocity, state, parameters):
    k, limit = parameters
    f = k * (u - state[0])
    if f > limit:
        return limit, (u - limit / k,)
    if f < -limit:
        return -limit, (u + limit / k,)
    return f, (state[0],)
"""
)


@slow
def test_a_law_of_ones_own_takes_at_most_twice_the_time_of_the_same_one_built_in(tmp_path: Path) -> None:
    file = tmp_path / "slider.py"
    file.write_text(SLIDER)
    (own,) = LAWS.load(file)
    n, made = 10, {}
    rows, line = np.eye(n), 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    made["own"] = [own.build(f"j{i}", {"direction": rows[i]}, {"stiffness": 0.5, "limit": 0.05}) for i in range(n)]
    made["built-in"] = [
        JenkinsElement(name=f"j{i}", direction=rows[i], tangential_stiffness=0.5, limit_force=0.05) for i in range(n)
    ]
    least, amplitude = dict.fromkeys(made, np.inf), {}
    for _ in range(6):  # the first one compiles; of the others the least disturbed counts
        for name, joints in made.items():
            system = JointedSystem(
                mass=np.eye(n), damping=0.03 * np.eye(n) + 0.01 * line, stiffness=line, joints=joints,
                harmonic_force=[np.zeros(n), 0.3 * rows[-1]],
            )  # fmt: skip
            balance = HarmonicBalance(system=system, n_harmonic=8)
            begin = time.process_time()
            curve = frequency_response(balance, 0.1, 1.6)
            least[name] = min(least[name], time.process_time() - begin)
            amplitude[name] = curve.amplitude(n - 1)
    LAWS.forget(file)
    np.testing.assert_allclose(amplitude["own"], amplitude["built-in"], rtol=1e-6)  # both to 1e-9 of the linear motion
    assert least["own"] < 2 * least["built-in"]


@pytest.mark.parametrize(
    "body",
    [
        "def f(u, velocity, state, parameters):\n    return parameters[0] * max(u - 1e-4, 0.0)",
        "def f(u, velocity, state, parameters):\n    return parameters[0] * abs(u) ** 1.5 * (1 if u > 0 else -1)",
        "def f(u, velocity, state, parameters):\n    return parameters[0] * 1e-3 * tanh(u / 1e-3) + 3 * velocity",
        "def f(u, velocity, state, parameters):\n    return 0.0 if u < 0 else parameters[0] * u",
    ],
    ids=["stop", "Hertz", "softening", "branches of other types"],
)
def test_a_scalar_function_is_enough(tmp_path: Path, body: str) -> None:
    file = tmp_path / "mine.py"
    file.write_text(f"{HEAD}\n@joint_law(**FACTS)\n{body}\n")
    (law,) = LAWS.load(file)
    try:
        test_laws.test_derivatives_equal_differences(law, 0)
        test_laws.test_hostile_parameters_and_rows_are_one_sentence(law)
        joint = law.build("joint", {"direction": ONE}, {"stiffness": 1e4})
        system = test_laws.vibrating(joint)
        state = steady_state(HarmonicBalance(system=system, n_harmonic=26, n_sample=2048), test_laws.OMEGA)
        steady = steady_motion(system, test_laws.OMEGA, tolerance=1e-7, steps_per_period=1024)
        scale = np.abs(state.coefficients[1]).max()
        np.testing.assert_allclose(steady.coefficients(4), state.coefficients[:4], rtol=0, atol=2e-5 * scale)
    finally:
        LAWS.forget(file)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("@joint_law(**(FACTS | dict(energy=1)) )\ndef f(u, v, s, p):\n    return u", ["mine.py, line", "energy", "1"]),
        ("F = dict(FACTS); del F['energy']\n@joint_law(**F)\ndef f(u, v, s, p):\n    return u", ["line 12", "energy"]),
        ("@joint_law(**FACTS)\ndef f(u, v, s, p):\n    return open(u)", ["line 11", '"mine"', "compiled"]),
        ("@joint_law(**FACTS)\ndef f(u, v, s, p):\n    return u, (1.0,)", ["line 11", '"mine"', "return a number"]),
        ("@joint_law(**FACTS)\ndef f(u, v):\n    return u", ["line 11", '"mine"', "compiled"]),
        ("@joint_law(**(FACTS | dict(n_state=2)))\ndef f(u, v, s, p):\n    return u, (u,)", ["a tuple of 2"]),
        ("@joint_law(**FACTS)\ndef f(u, v, s, p):\n    return u * random.random()", ["differences", "arguments alone"]),
        ("@joint_law(**FACTS)\ndef f(u, v, s, p):\n    return p[0] * (u + 1e-3 * (u // 1e-9))", ["mine"]),
        ("@joint_law(**FACTS)\ndef f(u, v, s, p):\n    return p[0] * u / 0.0", ["finite"]),
        ("@joint_law(**(FACTS | dict(kind='cubic')))\ndef f(u, v, s, p):\n    return u", ["cubic_spring.py", "cubic"]),
        ("@joint_law(**(FACTS | dict(parameters=['k'])))\ndef f(u, v, s, p):\n    return u", ["LawParameter", "'k'"]),
        (
            "@joint_law(**(FACTS | dict(parameters=[LawParameter(name='c', unit='N/m', meaning='c', typical=1.0, "
            "is_list=True)])))\ndef f(u, v, s, p):\n    return p[0] * u",
            ["mine", "list", '"c"'],
        ),
        ("@joint_law(**(FACTS | dict(n_state=-1)))\ndef f(u, v, s, p):\n    return u", ["n_state", "-1"]),
        ("@joint_law(**(FACTS | dict(typical_displacement=0)))\ndef f(u, v, s, p):\n    return u", ["typical_", "0"]),
    ],
)
def test_a_law_that_does_not_do_is_refused_when_it_is_registered(tmp_path: Path, text: str, words: list[str]) -> None:
    file = tmp_path / "mine.py"
    file.write_text(f"{HEAD}\n{text}\n")
    with pytest.raises(RegistryError) as error:
        LAWS.load(file)
    for word in words:
        assert word in str(error.value)
    assert "\n" not in str(error.value)
    assert "mine" not in LAWS


def test_the_example_of_the_documentation_is_a_law(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
    file = tmp_path / "example.py"
    file.write_text(text.split("```python\n")[1].split("```")[0])
    (law,) = LAWS.load(file)
    try:
        test_laws.test_derivatives_equal_differences(law, 0)
        test_laws.test_facts_fit_each_other(law)
    finally:
        LAWS.forget(file)


def test_a_static_load_stores_no_energy_of_the_vibration(law: type[Joint], tmp_path: Path) -> None:
    file = tmp_path / "cubic.py"
    body = "def f(u, velocity, state, parameters):\n    return parameters[0] * u**3"
    energy = "lambda u, state, parameters: parameters[0] * u**4 / 4"
    file.write_text(f"{HEAD}\n@joint_law(**(FACTS | dict(energy={energy}, stuck_stiffness=lambda k: 0.0)))\n{body}\n")
    (cubic,) = LAWS.load(file)
    chain = law.build("chain", {"direction": ONE}, {"stiffness": 1e6, "limit_force": 10.0})
    pairs = [
        (
            CubicSpring(name="c", direction=ONE, stiffness=1e12),
            cubic.build("c", {"direction": ONE}, {"stiffness": 1e12}),
        ),
        (
            JenkinsChain(
                name="j", direction=ONE, tangential_stiffness=(2.5e5,) * 4,
                limit_force=tuple(10.0 * (2 * i + 1) / 16 for i in range(4)),
            ),
            chain,
        ),
    ]  # fmt: skip
    try:
        for joints in pairs:
            factors = []
            for joint in joints:
                balance = HarmonicBalance(
                    system=replace(oscillator(joint), static_load=np.array([40.0])), n_harmonic=6, n_sample=512
                )
                factors.append(energy_balance(balance, steady_state(balance, 1150.0)).loss_factor)
            # The chain makes up its own energy of differences: 1e-8 of it.
            assert factors[1] == pytest.approx(factors[0], rel=1e-6)
    finally:
        LAWS.forget(file)
