"""A kind of case, added by one file outside the product: every command takes its cases, or says why it does not."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from casefile.errors import CaseError
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.prediction import Points, Predictor
from geometry.errors import RegistryError
from study import cli
from study.case.setup import read_case
from study.kind.registry import CASE_KINDS, CaseKind, open_case
from tests.in_this_process import pool_in_this_process

KIND = Path(__file__).with_name("mass_on_wall.py")
#: Of the kind, of the case, and of the stuck contact.
RATIO, MASS, STIFFNESS, CONTACT = 0.005, 1.0, 1e6, 0.3e6
#: Sticks at 0.1 N, slips at 20 N.
CASE = """\
schema = 2
title = "Mass on a wall"
[structure]
kind = "mass_on_wall"
mass = "1 kg"
stiffness = "1 N/um"
[[joint]]
kind = "friction"
name = "wall"
tangent = { place = "along" }
normal = { place = "across" }
normal_stiffness = "1 N/um"
tangential_stiffness = "0.3 N/um"
friction_coefficient = 0.5
preload = "20 N"
[[load]]
place = "along"
[harmonics]
highest = 1
samples = 64
[sweep]
from = "175 Hz"
to = "188 Hz"
step = "1 Hz"
levels = [0.1]
[limits]
frequencies = ["175 Hz", "188 Hz"]
population = 2
samples = 2
"""
LEVEL, REPEATS, NOISE = 0.1, 5, 2e-3


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A case of the kind, in the folder that the commands run in."""
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("study.limits.stored_search.worker_pool", pool_in_this_process)
    monkeypatch.setattr("study.modes.run.require_egl", lambda: None)
    CASE_KINDS.load(KIND)
    file = tmp_path / "wall.toml"
    file.write_text(CASE, encoding="utf-8")
    yield file
    CASE_KINDS.forget(KIND)


Documents = Callable[..., dict[str, Any]]


@pytest.fixture
def document(capfd: pytest.CaptureFixture[str]) -> Documents:
    """What a command answers to ``--json``."""

    def run(*words: str) -> dict[str, Any]:
        capfd.readouterr()
        assert cli.main([*words, "--json"]) == 0
        result: dict[str, Any] = json.loads(capfd.readouterr().out)
        return result

    return run


def stuck_amplitude(frequency: np.ndarray | float) -> np.ndarray:
    omega = 2 * np.pi * np.asarray(frequency)
    damping = 2 * RATIO * np.sqrt(MASS * STIFFNESS)
    return LEVEL / np.abs(STIFFNESS + CONTACT - omega**2 * MASS + 1j * omega * damping)


def test_solve_takes_it(case: Path, document: Documents) -> None:
    (curve,) = document("solve", case.name, "--out", "solved")["curves"]
    # The highest point is one of the curve, not between two: the exact response at its frequency.
    assert curve["peak_amplitude"] == pytest.approx(1e6 * stuck_amplitude(curve["peak_frequency_hz"]), rel=1e-8)
    assert curve["peak_frequency_hz"] == pytest.approx(np.sqrt((STIFFNESS + CONTACT) / MASS) / (2 * np.pi), abs=1)


def test_limits_takes_it(case: Path, document: Documents) -> None:
    (level,) = document("limits", case.name, "--out", "limited")["levels"]
    for side in ("lower", "upper"):
        # A contact that sticks is a spring, whatever its history; Newton's method stops at 1e-9.
        frequency = level[side]["frequency_hz"]
        assert level[side]["value"] == pytest.approx(1e6 * stuck_amplitude(frequency), rel=1e-8)


def measured(case: Path, folder: Path) -> None:
    """A campaign of the case itself, with noise of a thousandth of its amplitudes."""
    frequency = np.repeat([178.0, 180.0, 181.0, 182.0, 185.0], 2)
    n = len(frequency)
    points = Points(
        free=np.zeros(n, dtype=bool),
        level=np.full(n, LEVEL),
        frequency=frequency,
        sensor=np.array(["along"] * n),
        harmonic=np.ones(n, dtype=int),
    )
    exact = Predictor(points=points).predict(read_case(case).model).value
    random = np.random.default_rng(4)
    noise = random.standard_normal((REPEATS, n)) + 1j * random.standard_normal((REPEATS, n))
    table = Measurement(
        test=np.zeros(REPEATS * n, dtype=int),
        level=np.full(REPEATS * n, LEVEL),
        frequency=np.tile(frequency, REPEATS),
        sensor=np.zeros(REPEATS * n, dtype=int),
        harmonic=np.ones(REPEATS * n, dtype=int),
        order=np.arange(1, REPEATS * n + 1),
        repeat=np.repeat(np.arange(1, REPEATS + 1), n),
        sweep=np.tile([1, -1], REPEATS * n // 2),
        value=(exact * (1 + NOISE * noise)).ravel(),
    )
    sensor = MeasuredSensor(name="along", quantity="displacement", direction="x", place="along")
    campaign = Campaign(
        title="Shaken",
        folder=Path(),
        sensors=(sensor,),
        tests=(Test(name="stepped"),),
        measurement=table,
        held_out=HeldOut(),
    )
    write_campaign(campaign, folder)


def test_compare_add_and_undo_take_it(case: Path, document: Documents) -> None:
    measured(case, case.with_name("campaign"))
    before = document("compare", case.name, "campaign", "--out", "compared")["sets"]["training"]["whitened"]
    # Noise is told from five repeats: its mean square is that of chance within a factor.
    assert before < 1.5
    peak = document("solve", case.name, "--out", "solved")["curves"][0]["peak_frequency_hz"]
    drawn = case.read_bytes()
    document("add", "mass at along", "--value", "30 g")
    after = document("compare", case.name, "campaign", "--out", "compared")["sets"]["training"]["whitened"]
    assert after > 3 * before
    heavier = document("solve", case.name, "--out", "solved")["curves"][0]["peak_frequency_hz"]
    # 3 % more mass: the stuck resonance falls by 1.5 %, found at the points of a curve 1 Hz apart.
    assert heavier == pytest.approx(peak / np.sqrt(1.03), abs=1)
    assert heavier < peak - 1
    document("undo")
    assert case.read_bytes() == drawn


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("reduce", "nothing is left to reduce"),
        ("modes", "its modes are the motions along its two springs"),
    ],
)
def test_a_command_that_has_nothing_to_do_says_so_in_the_words_of_the_kind(
    case: Path, capfd: pytest.CaptureFixture[str], command: str, why: str
) -> None:
    assert cli.main([command, case.name, "--out", "out", "--quiet"]) == 2
    message = capfd.readouterr().err
    assert message.count("\n") == 1
    assert re.match(rf"wall\.toml:\d+: .*`stickslip {command}` .* case of a mass on a wall: .*{why}", message)


@pytest.mark.parametrize(
    ("right", "wrong", "line", "said"),
    [
        ('mass = "1 kg"\n', "", 3, 'structure.mass is missing; add mass = "1 kg"'),
        ('"1 kg"', '"1 N"', 5, '"N" makes it a force, but a mass is needed'),
        ('"1 kg"', '"-1 kg"', 5, 'structure.mass = "-1 kg": must be greater than 0 kg'),
        ('mass = "1 kg"', 'mass = "1 kg"\nfile = "a.npz"', 6, "structure.file: unknown key; known here: kind, mass,"),
        ('"mass_on_wall"', '"mass_on_wal"', 4, '"mass_on_wall", "matrices", .* did you mean "mass_on_wall"?'),
        ('place = "along" }', 'place = "alon" }', 10, 'did you mean "along"'),
    ],
)
def test_a_mistake_in_such_a_case_has_its_line(case: Path, right: str, wrong: str, line: int, said: str) -> None:
    case.write_text(CASE.replace(right, wrong, 1), encoding="utf-8")
    with pytest.raises(CaseError, match=".*".join(map(re.escape, said.split(".*")))) as caught:
        read_case(case)
    (problem,) = caught.value.problems
    assert problem.line == line


def test_a_kind_that_is_not_loaded_is_unknown(case: Path) -> None:
    CASE_KINDS.forget(KIND)
    with pytest.raises(CaseError, match=r'structure.kind = "mass_on_wall": must be "blade", .* or "rig"'):
        open_case(case)


def test_a_kind_without_a_fact_or_with_a_name_that_is_taken_is_refused(case: Path, tmp_path: Path) -> None:
    member = CASE_KINDS["mass_on_wall"]
    with pytest.raises(RegistryError, match=r'"mass_on_wall" is already registered in .*mass_on_wall.py, line'):
        CASE_KINDS.register(member)
    short = tmp_path / "short.py"
    short.write_text(
        "from types import SimpleNamespace\nfrom study.kind.registry import CASE_KINDS\n"
        'CASE_KINDS.register(SimpleNamespace(name="short", summary="none", table=None, structure=None, reduce=""))\n',
        encoding="utf-8",
    )
    with pytest.raises(RegistryError, match=r'short.py, line 3: .* "short" lacks modes \(what `stickslip modes` does'):
        CASE_KINDS.load(short)
    assert isinstance(member, CaseKind)
    assert "short" not in CASE_KINDS
