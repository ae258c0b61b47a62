"""Parameters written into a case of a rig come back when it is read, and its comments stay."""

from dataclasses import asdict
from pathlib import Path

import pytest

from study.kind.registry import open_case
from study.paper.case_file import write_parameters
from study.paper.parameters import RigParameters, read_parameters
from study.shipped_cases import RIG

OWN = RigParameters(
    kt=4.1e6, kn=7.2e6, mu=0.71, damping=2.1e-3, root=1.6e9, density=7712.0, shift_left=-1.2e-3, inclination_right=0.05,
    gap_angle=1e-4,
)  # fmt: skip


def read(text: str, tmp_path: Path) -> RigParameters:
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    return read_parameters(open_case(tmp_path / "rig.toml").case)


def test_written_parameters_come_back(tmp_path: Path) -> None:
    before = Path(RIG).read_text(encoding="utf-8")
    after = write_parameters(before, OWN, OWN.damping)
    # Six digits are written at least.
    assert asdict(read(after, tmp_path)) == pytest.approx(asdict(OWN), rel=2e-6)
    assert {line for line in before.splitlines() if line.startswith("#")} <= set(after.splitlines())


def test_what_is_written_twice_is_there_once_and_what_vanishes_is_taken_out(tmp_path: Path) -> None:
    text = write_parameters(Path(RIG).read_text(encoding="utf-8"), OWN, OWN.damping)
    plain = RigParameters(kt=4e6, kn=8e6, mu=0.8, damping=2e-3, root=1.6e9, density=7712.0)
    again = read(write_parameters(text, plain, plain.damping), tmp_path)
    assert asdict(again) == pytest.approx(asdict(plain), rel=2e-6)
