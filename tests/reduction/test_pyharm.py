"""A structure written for pyHarm: the layout, what is refused, and pyHarm's own residual where it is installed."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.errors import ExchangeError
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
from reduction.pyharm import make_pyharm_input, save_pyharm

N, N_HARMONIC, N_SAMPLE = 3, 6, 256
M = np.diag([1.0, 2.0, 1.5])
K = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
C = 2e-4 * K
SLIDER = JenkinsElement(name="slider", direction=along(N, {2: 2.0, 0: -2.0}), tangential_stiffness=1e4, limit_force=1.0)
STOP = ElasticStop(name="stop", direction=along(N, {1: 0.5}), stiffness=2e5, gap=1e-5)
CUBIC = CubicSpring(name="cubic", direction=along(N, {0: -1.5}), stiffness=4e10)
OMEGA = 120.0  # rad/s, near the first resonance
#: An interpreter that has pyHarm, which brings jax along; tests with it run where this names one.
PYHARM = os.environ.get("STICKSLIP_PYHARM", "")


def system(*joints: object, **loads: object) -> JointedSystem:
    force = np.zeros((3, N), dtype=complex)
    force[1] = [1.0 - 2.0j, 0.0, 3.0]
    force[2, 1] = 0.5j
    given = {"harmonic_force": force, "static_load": [0.0, -0.7, 0.0], **loads}
    return JointedSystem(mass=M, damping=C, stiffness=K, joints=joints, **given)  # type: ignore[arg-type]


def test_the_input_has_the_layout_of_pyharm() -> None:
    data = make_pyharm_input(system(SLIDER, STOP, CUBIC), 50.0, 200.0)
    assert data["system"] == {"type": "Base", "nh": 5, "nti": 256}
    part = data["substructures"]["structure"]
    assert (part["ndofs"], part["nnodes"], part["nmodes"]) == (1, N, 0)
    assert {name: np.array(rows).tolist() for name, rows in part["matrix"].items()} == {
        "M": M.tolist(), "C": C.tolist(), "K": K.tolist()
    }  # fmt: skip
    assert data["analysis"] == {"frf": {"study": "frf", "puls_inf": 50.0, "puls_sup": 200.0}}
    connectors = data["connectors"]
    # The weights of the row are in the numbers: the virtual work of u = s q is that of k s^2, N s, k s^4 and g / s.
    assert connectors["slider"] == {
        "type": "Jenkins", "connect": {"structure": [2], "INTERNAL": [0]}, "dirs": [0], "mu": 1.0, "N0": 2.0, "k": 4e4,
    }  # fmt: skip
    assert connectors["stop"] == {
        "type": "PenaltyUnilateralGap", "connect": {"structure": [1]}, "dirs": [0], "k": 5e4, "g": 2e-5,
    }  # fmt: skip
    assert connectors["cubic"] == {
        "type": "CubicSpring", "connect": {"structure": [0]}, "dirs": [0], "k": 1.5**4 * 4e10,
    }  # fmt: skip
    loads = [item for item in connectors.values() if item["type"] == "GOForcing"]
    assert [(item["ho"], item["connect"]["structure"][0]) for item in loads] == [(0, 1), (1, 0), (1, 2), (2, 1)]
    assert loads[0]["amp"] == -0.7
    np.testing.assert_allclose([loads[1]["amp"], loads[1]["phi"]], [np.sqrt(5), np.arctan2(2, 1)], rtol=1e-15)


def test_the_file_holds_what_the_dictionary_holds(tmp_path: Path) -> None:
    save_pyharm(system(SLIDER), tmp_path / "s.json", 50.0, 200.0, n_harmonic=4, n_sample=64)
    read = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert read == make_pyharm_input(system(SLIDER), 50.0, 200.0, n_harmonic=4, n_sample=64)


#: The loader of the module's docstring, and the residual of a motion given in pyHarm's order.
RESIDUAL = """
import json, logging, sys
import numpy as np
from pyHarm.Maestro import Maestro
logging.disable(logging.CRITICAL)
with open("s.json") as file:
    data = json.load(file)
for part in data["substructures"].values():
    part["matrix"] = {name: np.array(rows) for name, rows in part["matrix"].items()}
print(np.abs(Maestro(data).system.Residual(np.load("x.npy"))).max())
"""


@pytest.mark.skipif(not PYHARM, reason="STICKSLIP_PYHARM names no interpreter with pyHarm-os")
def test_pyharm_finds_our_response_in_balance(tmp_path: Path) -> None:
    whole = system(SLIDER, STOP, CUBIC)
    balance = HarmonicBalance(system=whole, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
    q = steady_state(balance, OMEGA).coefficients
    assert np.abs(q[3]).max() > 1e-2 * np.abs(q[1]).max()  # the joints are at work
    save_pyharm(whole, tmp_path / "s.json", 50.0, 200.0, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
    rows = [q[0].real, *(part for row in q[1:] for part in (row.real, -row.imag)), [OMEGA]]
    np.save(tmp_path / "x.npy", np.concatenate(rows))
    command = [PYHARM, "-c", RESIDUAL]
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False, env=clean)
    assert done.returncode == 0, done.stderr
    # Of loads of 3 N: Newton stops at 1e-9 of the motion, and the stiffness of the joints turns that into force.
    assert float(done.stdout.split()[-1]) < 3e-6


CONTACT = {
    "normal": along(N, {2: 1.0}),
    "tangents": between(N, 0),
    "normal_stiffness": 1.0,
    "tangential_stiffness": 1.0,
}


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (system(FrictionContact(name="rub", **CONTACT, friction_coefficient=0.1)), '"rub" .* normal force varies'),
        (system(QuadraticDamper(name="drag", direction=between(N, 1), damping=1.0)), 'joint "drag" .*d |v| v'),
        (system(ElasticStop(name="s", direction=along(N, {1: -1.0}), stiffness=1.0)), 'joint "s" .*negative direction'),
        (
            system(CubicSpring(name="sum", direction=along(N, {1: 1.0, 2: 0.5}), stiffness=1.0)),
            'joint "sum" acts on 2 .* weights 1, 0.5, but',
        ),
        (system(harmonic_force=np.vstack([np.zeros((7, N)), [0, 0, 4.0]])), "harmonic 7 on degree of freedom 2"),
        (
            system(CubicSpring(name="load of harmonic 1 on 0", direction=between(N, 1), stiffness=1.0)),
            "name of a load",
        ),
    ],
)
def test_what_pyharm_lacks_is_refused_by_name(bad: JointedSystem, message: str) -> None:
    with pytest.raises(ExchangeError, match=message):
        make_pyharm_input(bad, 50.0, 200.0)


def test_ranges_and_harmonics_without_a_curve_are_refused() -> None:
    with pytest.raises(ExchangeError, match="200 to 50 rad/s must be positive and ascend"):
        make_pyharm_input(system(), 200.0, 50.0)
    with pytest.raises(ExchangeError, match="n_harmonic = 1 keeps only the mean"):
        make_pyharm_input(system(), 50.0, 200.0, n_harmonic=1)
