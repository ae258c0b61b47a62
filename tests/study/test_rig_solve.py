"""``stickslip solve`` of a coarse rig: rest, balance of forces, histories, and mistakes in one sentence."""

import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from casefile.errors import CaseError
from geometry.rig import SIDES, mating_pairs
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.objective import ContactForceHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from hbsolve.steady_state import steady_state
from pipeline import parallel
from pipeline.store import Store
from study.case.setup import read_case
from study.kind.rig.forces import compute_rig_forces
from study.kind.rig.structure import PreloadedRig
from study.run_context import silent_run
from study.solve.model import SolveModel, make_solve_model
from tests.slow import slow

RigCommand = Callable[..., "subprocess.CompletedProcess[str]"]
SWEEP = """\
[sweep]
from = "180 Hz"
to = "200 Hz"
step = "5 Hz"
levels = [2]
histories = 2
[harmonics]
highest = 3
samples = 64
"""
#: Round-off of static solutions, relative: stiffness of 1e9 N/m beside springs of 1e6 N/m.
ROUND_OFF = 1e-6


@dataclass(frozen=True)
class Solved:
    preloaded: PreloadedRig
    model: SolveModel


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, reduced_rig: Path) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    shutil.copytree(reduced_rig, folder / "cache")
    return folder


def solved(store: Path, text: str) -> Solved:
    file = store / "case.toml"
    file.write_text(text, encoding="utf-8")
    read = read_case(file, run=replace(silent_run(), store=Store(store / "cache")))
    return Solved(read.structure.details, make_solve_model(read))


@pytest.fixture(scope="module")
def plain(store: Path, short_rig: str) -> Solved:
    return solved(store, short_rig + SWEEP)


def resultants(found: Solved) -> dict[str, np.ndarray]:
    """Force of each line on its damper at rest, by pair [N]: what pushes and drags is not the damper but the other."""
    rest, pairs, force = found.preloaded.static_state, mating_pairs(found.preloaded.model.rig), {}
    names = [contact.name for contact in rest.contacts]
    for name, pair in pairs.items():
        total, line = np.zeros(3), pair.damper_line
        q = rest.displacement
        for station, member in enumerate(found.preloaded.joined.lines[name]):
            row = names.index(member)
            total -= rest.normal[row] * line.normal[station] + rest.tangential[row][0] * line.tangents[station, 0]
            if len(rest.tangential[row]) == 1:
                # The second tangent is a spring: along x.
                across = found.preloaded.reduction.assembly
                own = across.rows(pair.damper, line.name).reshape(-1, 3)[station]
                other = across.rows(pair.other, pair.other_line.name).reshape(-1, 3)[station]
                k_t = rest.contacts[row].tangential_stiffness
                total -= k_t * line.tangents[station, 1] * (line.tangents[station, 1] @ (q[own] - q[other]))
        force[name] = total
    return force


def test_contacts_carry_the_dead_weights(plain: Solved) -> None:
    force = resultants(plain)
    for side in SIDES:
        on_damper = force[f"{side}_blade"] + force[f"{side}_decoupler"]
        assert on_damper == pytest.approx([0, 0, -55.0], abs=55 * ROUND_OFF)
    # The rig is symmetric about y = 0.
    for other in ("blade", "decoupler"):
        mirrored = force[f"left_{other}"] * [1, -1, 1]
        assert force[f"right_{other}"] == pytest.approx(mirrored, abs=55 * ROUND_OFF)


def test_a_wire_that_is_shifted_and_leans_shares_its_pull_unevenly(store: Path, short_rig: str, plain: Solved) -> None:
    leaning = solved(
        store, short_rig + '[structure.dead_weight.left]\nshift = "-3 mm"\ninclination = "4 deg"\n' + SWEEP
    )
    force, even = resultants(leaning), resultants(plain)
    pull = 55 * np.array([0, np.sin(np.deg2rad(4)), np.cos(np.deg2rad(4))])
    assert force["left_blade"] + force["left_decoupler"] == pytest.approx(-pull, abs=55 * ROUND_OFF)
    # Nearer to the blade: the blade has more.
    assert force["left_blade"][2] < even["left_blade"][2] - 3
    assert force["right_blade"] + force["right_decoupler"] == pytest.approx([0, 0, -55], abs=55 * ROUND_OFF)


def test_rest_is_a_steady_state_of_the_solver(plain: Solved) -> None:
    model = plain.model
    balance = HarmonicBalance(system=model.system, n_harmonic=2, n_sample=64, level=1e-9)
    state = steady_state(balance, 2 * np.pi * 150.0, slider=model.curves[0].slider)
    assert np.abs(state.coefficients[0]).max() < ROUND_OFF * np.abs(plain.preloaded.static_state.displacement).max()


def test_load_cells_feel_the_contact_forces(plain: Solved) -> None:
    model = plain.model
    balance = HarmonicBalance(system=model.system, n_harmonic=4, n_sample=64, level=2.0)
    # So slow that nothing has inertia: then eqs 1 and 2 are the balance of forces.
    state = steady_state(balance, 2 * np.pi * 0.5, slider=model.curves[0].slider)
    result = compute_rig_forces(plain.preloaded, balance, state)
    # Rows of reactions and contacts go through different products of the same reduced matrices.
    assert max(result.inertia_error.values()) < 1e-4
    # The axes of the arms meet on the contact line, so that they carry all but 1.5 % along themselves, coarse or fine.
    assert max(result.bending_error.values()) < 0.03
    state = steady_state(balance, 2 * np.pi * 150.0, slider=model.curves[0].slider)
    fast = compute_rig_forces(plain.preloaded, balance, state)
    assert max(fast.inertia_error.values()) > 10 * max(result.inertia_error.values())


def test_histories_leave_each_line_a_share_of_its_limit(plain: Solved) -> None:
    first, second = (curve.slider for curve in plain.model.curves)
    rest = plain.preloaded.static_state
    k_t = np.array([contact.tangential_stiffness for contact in rest.contacts])
    assert -k_t * first == pytest.approx(np.concatenate(rest.tangential), abs=1e-12)
    share = -k_t * second / (0.8 * rest.normal)
    lines = np.split(share, 4)
    assert all(np.ptp(line) < 1e-9 for line in lines)
    assert len({round(float(line[0]), 6) for line in lines}) == 4
    assert np.abs(share).max() <= 0.9


def test_crowned_lines_press_in_the_middle(store: Path, short_rig: str, plain: Solved) -> None:
    crowned = solved(store, short_rig.replace("mu = 0.8", 'mu = 0.8\ncrowning = "2.5 um"') + SWEEP)
    normal, even = (np.split(item.preloaded.static_state.normal, 4)[0] for item in (crowned, plain))
    per_length = np.array([2, 1, 1, 1, 1, 1, 2])  # the end stations stand for half as much
    assert (normal * per_length)[3] > 2 * (normal * per_length)[[0, 6]].max()
    assert normal.sum() == pytest.approx(even.sum(), rel=0.02)


@pytest.fixture(scope="module")
def document(store: Path, short_rig: str, stickslip: RigCommand) -> dict[str, Any]:
    (store / "my.toml").write_text(short_rig + SWEEP, encoding="utf-8")
    done = stickslip(store, "solve", "my.toml", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


#: The damper turned about x and moved along both lines: the gap of one grows towards its shoulder as that of the other
#: grows towards its end.
ABSORBED = """\
crowning = "2.5 um"
[structure.contact.left_blade]
gap_end = "3 um"
[structure.contact.left_decoupler]
gap_start = "5 um"
gap_end = "2 um"
"""
#: A line that is tilted alone.
TILTED = """\
crowning = "2.5 um"
[structure.contact.left_blade]
gap_end = "3 um"
"""


def test_gaps_that_a_rigid_motion_of_the_damper_absorbs_change_no_limit(store: Path, short_rig: str) -> None:
    crowned, absorbed, tilted = (
        solved(store, short_rig + gaps + SWEEP) for gaps in ('crowning = "2.5 um"\n', ABSORBED, TILTED)
    )
    for one, other in zip(
        crowned.preloaded.static_state.contacts, absorbed.preloaded.static_state.contacts, strict=True
    ):
        assert (other.preload, other.gap) == pytest.approx((one.preload, one.gap), rel=ROUND_OFF, abs=1e-11)
    np.testing.assert_allclose(
        absorbed.preloaded.static_state.slider, crowned.preloaded.static_state.slider, atol=1e-11
    )
    limits = [normal_force_limits(item) for item in (crowned, absorbed)]
    # Both searches take the same steps but for round-off, and stop at 1e-4.
    assert limits[1] == pytest.approx(limits[0], rel=1e-4)
    # What the damper cannot absorb presses other stations.
    moved = [
        abs(one.preload - other.preload)
        for one, other in zip(
            crowned.preloaded.static_state.contacts, tilted.preloaded.static_state.contacts, strict=True
        )
    ]
    assert max(moved) > 0.1 * max(item.preload for item in crowned.preloaded.static_state.contacts)


def normal_force_limits(found: Solved) -> np.ndarray:
    """Of the mean normal force on the left line of the blade, above the resonance, with one harmonic [N]."""
    balance = HarmonicBalance(system=found.model.system, n_harmonic=2, n_sample=32)
    force = ContactForceHarmonic(joints=found.preloaded.joined.lines["left_blade"], direction=-1)
    problem = limit_problem(balance, force, nominal=found.preloaded.static_state.slider, reach=2e-6)
    limits = response_limits(problem, [2 * np.pi * 260], [0.1], settings=LimitSettings(population=2, sample=0))
    return limits.value.ravel()


@slow
def test_the_command_says_how_the_rig_rests_and_what_each_curve_does(document: dict[str, Any], store: Path) -> None:
    assert [curve["label"] for curve in document["curves"]] == ["2 N, history 1", "2 N, history 2"]
    assert sum(line["n_closed"] for line in document["rest"].values()) == 28
    for damper in document["dampers"].values():
        # Two lines in parallel, each with k_t across.
        assert damper["stiffness"]["x"] == pytest.approx(2 * 4.6e6, rel=1e-6)
        assert min(damper["frequency_hz"]) > 100
    for curve in document["curves"]:
        assert set(curve["largest_ratio_t_n"]) == set(document["rest"])
    assert all((store / file).is_file() for file in document["files"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (SWEEP, "", "there is no [sweep]"),
        (
            "[sweep]",
            '[structure.dead_weight.right]\ninclination = "80 deg"\n[sweep]',
            'structure.dead_weight.right.inclination = "80 deg": under the static load "right_blade" opens along',
        ),
        ("[sweep]", '[structure.dead_weight.left]\nshift = "7 mm"\n[sweep]', "is outside the damper's cylinder"),
        # A wire that pushes down instead of pulling up takes the damper out of its grooves.
        (
            "[sweep]",
            '[structure.dead_weight]\nforce = "-55 N"\n[sweep]',
            'structure.dead_weight.force = "-55 N": must be greater than 0 N',
        ),
        # A slip of the unit: the damper would turn by degrees until the line touches.
        (
            "[sweep]",
            '[structure.contact.left_blade]\ngap_end = "5 mm"\n[sweep]',
            'left_blade.gap_end = "5 mm": must be less than or',
        ),
        (
            "[sweep]",
            '[structure.contact.left_blade]\ngap_end = "2 um"\ngap_angle = "0.1 deg"\n[sweep]',
            "gap_end and gap_angle both give the gap: remove one",
        ),
        (
            "[sweep]",
            '[structure.contact.left_blade]\ngap_angle = "-0.1 deg"\n[sweep]',
            "gap_angle = -0.1 deg gives a gap of -21.18 um at the damper's shoulder",
        ),
        (
            "[sweep]",
            '[structure.contact.left_blade]\ngap_angle = "9 deg"\n[sweep]',
            'gap_angle = "9 deg": must lie between',
        ),
    ],
)
def test_a_mistake_is_one_sentence(store: Path, short_rig: str, old: str, new: str, said: str) -> None:
    text = (short_rig + SWEEP).replace(old, new)
    with pytest.raises(CaseError) as raised:
        solved(store, text)
    (problem,) = raised.value.problems
    assert said in str(problem)
    assert "case.toml" in str(problem)


def test_after_a_mistake_is_mended_nothing_that_was_finished_is_computed_again(
    store: Path, short_rig: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Another size than in the other tests, so that no body has been reduced yet.
    short = short_rig.replace('size = "8 mm"', 'size = "9 mm"')
    with pytest.raises(CaseError, match="opens along its whole length"):
        solved(store, short + '[structure.dead_weight.right]\ninclination = "80 deg"\n' + SWEEP)

    def refuse(*_: object) -> None:
        raise AssertionError("something was computed again")

    monkeypatch.setattr(parallel, "_start", refuse)
    corrected = solved(store, short + '[structure.dead_weight.right]\ninclination = "8 deg"\n' + SWEEP)
    assert (corrected.preloaded.static_state.normal > 0).all()
