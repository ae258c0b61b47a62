"""A test at constant response, whose force differs from point to point, shows the damping of the structure."""

import json
from pathlib import Path

import numpy as np
import pytest

from study.cli import main

MASS, STIFFNESS, RATIO = 1.3, 5e5, 0.004
CASE = """schema = 2
[structure]
kind = "plain"
file = "one.npz"
[[structure.dof]]
direction = "z"
[[load]]
dof = 0
[[sensor]]
name = "tip"
dof = 0
[harmonics]
highest = 1
"""
CAMPAIGN = """schema = 1
[convention]
time = "exp(+i omega t)"
amplitude = "peak"
[units]
level = "N"
frequency = "Hz"
[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
noise = "0.2 %"
[[test]]
name = "constant response"
configuration = "jointed"
[[run]]
test = "constant response"
file = "run.csv"
control = "response"
[run.columns]
frequency = "f"
force = { column = "F", unit = "N" }
tip = { amplitude = "x", phase = "p", unit = "um", phase_unit = "rad" }
"""


def test_damping_is_read_from_the_force_that_a_constant_response_takes(
    tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    frequency = np.linspace(95, 102.5, 41)
    omega = 2 * np.pi * frequency
    dynamic = STIFFNESS - MASS * omega**2 + 2j * RATIO * omega * np.sqrt(STIFFNESS * MASS)
    # Response 3 um at the phase of the structure; the force that this takes, with 0.2 % of noise.
    force = 3e-6 * np.abs(dynamic) * (1 + 2e-3 * np.random.default_rng(1).standard_normal(len(omega)))
    rows = np.column_stack([frequency, force, np.full_like(frequency, 3.0), -np.angle(dynamic)])
    lines = ["f,F,x,p", *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "run.csv").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "tests" / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    c = np.array([[2 * RATIO * np.sqrt(STIFFNESS * MASS)]])
    np.savez(tmp_path / "one.npz", M=np.array([[MASS]]), K=np.array([[STIFFNESS]]), C=c)
    (tmp_path / "one.toml").write_text(CASE, encoding="utf-8")
    words = ["compare", str(tmp_path / "one.toml"), str(tmp_path / "tests"), "--out", str(tmp_path / "out"), "--json"]
    assert main(words) == 0
    (peak,) = json.loads(capfdbinary.readouterr().out)["resonances"]
    assert peak["frequency_hz"] == pytest.approx(np.sqrt(STIFFNESS / MASS) / (2 * np.pi), rel=1e-4)
    # Noise of 0.2 % on some ten points of the peak moves its width by some 0.5 %.
    assert peak["damping_ratio"] == pytest.approx(RATIO, rel=0.02)
    assert peak["predicted_damping_ratio"] == pytest.approx(RATIO, rel=0.005)
