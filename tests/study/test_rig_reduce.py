"""`stickslip reduce` of a rig: a case file becomes five reduced bodies, and mistakes become one sentence each."""

import json
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from casefile.errors import CaseError
from fe.dense_modes import compute_dense_modes
from fe.face_integral import find_outer_faces
from fe.file.mesh_file import read_mesh
from fe.pressed_disc import find_disc_weights
from figure.scene import off_screen
from geometry.errors import MissingSoftware
from geometry.rig import Rig, mating_pairs, named_points
from pipeline import parallel
from pipeline.progress import SilentProgress
from pipeline.store import Outcome, Store
from reduction.assembly import ReducedAssembly
from reduction.file.rom_hdf5 import load_assembly
from reduction.jointed_system import FrictionContact
from reduction.stuck import stuck_stiffness
from study.case.setup import read_case
from study.kind.registry import open_case
from study.kind.rig.contact import list_dead_weights, make_line_pairs
from study.kind.rig.model import BODIES, RigModel
from study.kind.rig.reduce import reduce_rig_case
from study.kind.rig.reduction import (
    ReducedBody,
    RigReduction,
    check_bodies,
    list_reduction_tasks,
    make_rig_reduction,
    mirror_model,
    reduced_body,
)
from study.kind.rig.table import make_rig_model
from study.reduce.report import report_fewer_rig_modes
from study.run_context import RunContext, silent_run
from study.shipped_cases import BLADE, RIG
from tests.slow import slow

RigCommand = Callable[..., "subprocess.CompletedProcess[str]"]
N_MODE = 40
TITLED = 'title = "Short rig"\n[structure]\n'
PICTURES = {"my_assembly.png", "my_contact.png", "my_mode1.png", "my_mode2.png", "my_mode3.png"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, short_rig: str) -> Path:
    where = tmp_path_factory.mktemp("rig")
    (where / "my.toml").write_text(short_rig.replace("[structure]\n", TITLED), encoding="utf-8")
    return where


@pytest.fixture(scope="module")
def document(folder: Path, stickslip: RigCommand) -> dict[str, Any]:
    done = stickslip(folder, "reduce", "my.toml", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def model(folder: Path) -> RigModel:
    return make_rig_model(open_case(folder / "my.toml").case)


@pytest.fixture(scope="module")
def by_body(model: RigModel) -> dict[str, ReducedBody]:
    """All five reduced by themselves, none as a mirror image."""
    return {body: reduced_body(model, body) for body in BODIES}


def test_the_command_writes_all_files_and_counts_what_it_kept(folder: Path, document: dict[str, Any]) -> None:
    names = {Path(file).name for file in document["files"]}
    assert names - PICTURES == {"my.step", "my.vtu", "my_rom.h5", "my_reduce.html"}
    assert {file.name for file in (folder / "out").iterdir()} == names
    assert "MANIFOLD_SOLID_BREP" in (folder / "out" / "my.step").read_text(encoding="utf-8")
    # Stations of two lines, excitation, response and two laser points; two lines and three points; a line and a point.
    kept = {"blade": 3 * 18, "damper": 3 * 17, "decoupler": 3 * 8}
    bodies = document["bodies"]
    assert tuple(bodies) == BODIES
    assert all(row["n_boundary"] == kept[body.partition("_")[0]] for body, row in bodies.items())
    assert sum(row["n_mode"] for row in bodies.values()) == N_MODE
    assert document["n_reduced"] == sum(row["n_boundary"] + row["n_mode"] for row in bodies.values())
    assert document["n_dof"] == sum(row["n_dof"] for row in bodies.values())
    assert all(0.5 < row["least_scaled_jacobian"] <= 1 for row in bodies.values())


def test_the_model_is_the_rig_at_rest(folder: Path, document: dict[str, Any]) -> None:
    model = read_case(folder / "my.toml", run=replace(silent_run(), store=Store(folder / "cache"))).model
    system = model.system
    assert tuple(model.lines) == ("left_blade", "left_decoupler", "right_blade", "right_decoupler")
    assert model.preloads == ("left dead weight", "right dead weight")
    stuck = np.sqrt(compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints)).lambda_) / (
        2 * np.pi
    )
    np.testing.assert_allclose(stuck[:3], document["stuck_frequency_hz"][:3], rtol=1e-7)
    # Without contacts the dampers hang at 20 Hz. Springs in their second tangents stay, which the blade's bending along
    # y does not move.
    alone = np.sqrt(compute_dense_modes(system.mass, model.without_contacts().system.stiffness).lambda_) / (2 * np.pi)
    # Their motions in the plane of y and z: two translations and a rotation of each.
    assert np.count_nonzero(np.isclose(alone, 20.0, rtol=1e-3)) == 6
    assert np.abs(alone / document["blade_frequency_hz"][0] - 1).min() < 1e-4
    # Where contacts press with their preloads, the static load balances them but for what the tangents carry.
    pushed = sum(item.preload * item.normal for item in system.joints if isinstance(item, FrictionContact))
    assert 0 < np.linalg.norm(system.static - pushed) < 0.2 * np.linalg.norm(pushed)
    weight = model.dead_weights["left dead weight"].row
    assert np.linalg.norm(weight) > 0
    assert not weight[[dof.body == "blade" for dof in model.dofs]].any()


def test_the_blade_has_its_own_material_and_root_and_nothing_is_reduced_again(
    folder: Path, document: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study.kind.rig.reduction.craig_bampton", None)
    first = document["blade_frequency_hz"][0]

    def frequencies(tables: str) -> tuple[NDArray[np.float64], ReducedAssembly]:
        file = folder / "other.toml"
        file.write_text((folder / "my.toml").read_text(encoding="utf-8") + tables, encoding="utf-8")
        run = replace(silent_run(), store=Store(folder / "cache"))
        reduction = read_case(file, run=run).structure.details.reduction
        return reduction.assembly.bodies["blade"].modes(3).frequency, reduction.assembly

    own, assembly = frequencies('[structure.blade_material]\ndensity = "7200 kg/m^3"\nyoung = "200 GPa"\n')
    # Both scale all frequencies of the body; other ones of all modes may be kept, which hardly matters to the first.
    assert own[0] / first == pytest.approx(np.sqrt(7800 / 7200 * 200 / 210), rel=1e-4)
    damper = assembly.bodies["damper_right"]
    rigid = np.zeros(damper.n_dof)
    rigid[: damper.n_boundary][damper.boundary_direction == 2] = 1.0
    steel = rigid @ damper.mass @ rigid
    relaxed, assembly = frequencies('[structure.root]\nstiffness = "465 N/um"\n')
    assert 0.85 < relaxed[0] / first < 0.95
    assert rigid @ assembly.bodies["damper_right"].mass @ rigid == pytest.approx(steel)
    nearly, _ = frequencies('[structure.root]\nstiffness = "1e9 N/um"\n')
    # A millionth of the compliance that lowers it by a tenth.
    assert nearly[0] == pytest.approx(first, rel=1e-6)


@pytest.mark.draws
def test_the_pictures_are_there(folder: Path, document: dict[str, Any]) -> None:
    assert {Path(file).name for file in document["files"]} >= PICTURES
    for name in PICTURES:
        assert (folder / "out" / name).read_bytes().startswith(b"\x89PNG")


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Stiffness of a pair of lines [N/m]."""

    normal: float = 8.5e6
    tangential: float = 4.6e6


def stuck_by_hand(assembly: ReducedAssembly, springs: dict[str, Springs]) -> NDArray[np.float64]:
    """Stiffness with three springs at each station, written out."""
    stiffness = np.array(assembly.stiffness)
    blade = {"left_blade": "contact_negative", "right_blade": "contact_positive"}
    for name, pair in mating_pairs(Rig()).items():
        own = assembly.rows(pair.damper, "contact_blade" if name in blade else "contact_decoupler").reshape(7, 3)
        other = assembly.rows(pair.other, blade.get(name, "contact")).reshape(7, 3)
        for station, share in enumerate(np.array([1, 2, 2, 2, 2, 2, 1]) / 12):
            n = pair.damper_line.normal[station]
            tensor = springs[name].tangential * (np.eye(3) - np.outer(n, n)) + springs[name].normal * np.outer(n, n)
            a, b = own[station], other[station]
            for rows, columns, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                stiffness[np.ix_(rows, columns)] += sign * share * tensor
    return stiffness


def frequencies(mass: NDArray[np.float64], stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    lambda_ = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    return np.asarray(np.sqrt(lambda_.clip(min=0)) / (2 * np.pi))


def test_the_stuck_frequencies_are_those_of_springs_put_on_the_assembly_file_by_hand(
    folder: Path, document: dict[str, Any]
) -> None:
    assembly = load_assembly(folder / "out" / "my_rom.h5")
    by_hand = frequencies(assembly.mass, stuck_by_hand(assembly, dict.fromkeys(mating_pairs(Rig()), Springs())))
    # A dense solve in this form is good to 1e-16 times the highest eigenvalue, 1e8 times the first one.
    np.testing.assert_allclose(document["stuck_frequency_hz"], by_hand[:6], rtol=1e-7)
    blade = assembly.bodies["blade"]
    np.testing.assert_allclose(document["blade_frequency_hz"], frequencies(blade.mass, blade.stiffness)[:3], rtol=1e-7)
    np.testing.assert_allclose(np.sum(list(document["energy_share"].values()), axis=0), 1, rtol=1e-9)
    # Only contact holds the dampers: without it they have their twelve rigid motions.
    free = frequencies(assembly.mass, np.array(assembly.stiffness))
    assert free[11] < 1e-3 * by_hand[0] < free[12]
    assert assembly.bodies["damper_left"].provenance["body"] == "damper_left"


def test_the_mesh_file_holds_all_bodies_and_the_drawn_modes(folder: Path, document: dict[str, Any]) -> None:
    import meshio

    mesh = read_mesh(folder / "out" / "my.vtu")
    assert {*mesh.cell_sets} == {*BODIES}
    for name, pair in mating_pairs(Rig()).items():
        for body, line in ((pair.damper, pair.damper_line), (pair.other, pair.other_line)):
            result = mesh.points[mesh.node_sets[f"{body}.{line.name}"]]
            np.testing.assert_allclose(result, pair.damper_line.stations, atol=1e-9, err_msg=name)
    fields = {name: u for name, u in meshio.read(folder / "out" / "my.vtu").point_data.items() if "stuck" in name}
    assert [name.partition(":")[0] for name in fields] == [f"stuck mode {number}" for number in (1, 2, 3)]
    held = mesh.nodes("blade.clamp")
    assert all(np.abs(u).max() > 0 and not u[held].any() for u in fields.values())


def test_a_second_run_and_one_with_other_contacts_start_no_process(
    folder: Path,
    document: dict[str, Any],
    short_rig: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("something was computed again")

    monkeypatch.setattr(parallel, "_start", refuse)
    output = folder / "again"
    output.mkdir()
    run = RunContext(output=output, store=Store(folder / "cache"), progress=SilentProgress(), json=True, quiet=True)
    again = reduce_rig_case(open_case(folder / "my.toml"), run)
    # Dense eigenvalues are good to the round-off of the largest one, which is up to 1e6 times these; how the sums are
    # split depends on the threads that are free.
    frequency = np.array(again.document["stuck_frequency_hz"])
    np.testing.assert_allclose(frequency, document["stuck_frequency_hz"], rtol=1e-9)
    # The command adds its page.
    *expected, page = [Path(file).name for file in document["files"]]
    assert [Path(file).name for file in again.document["files"]] == expected
    assert page == "my_reduce.html"

    def cannot_draw() -> None:
        raise MissingSoftware("this machine draws nothing")

    monkeypatch.setattr(off_screen, "require_egl", cannot_draw)
    other = (
        short_rig.replace("[structure]\n", TITLED)
        + '[structure.contact.left_blade]\nkn = "4 N/um"\n[structure.damping]\nratio = "1 %"\n'
    )
    (folder / "other.toml").write_text(other, encoding="utf-8")
    changed = reduce_rig_case(open_case(folder / "other.toml"), run)
    assert "fixed-interface modes" not in str(changed.text)
    springs = {name: Springs(normal=4e6) if name == "left_blade" else Springs() for name in mating_pairs(Rig())}
    assembly = load_assembly(output / "other_rom.h5")
    by_hand = frequencies(assembly.mass, stuck_by_hand(assembly, springs))[:6]
    (sentence,) = report_fewer_rig_modes(assembly, 41)
    assert "all 40 fixed-interface modes of the bodies are kept" in sentence
    np.testing.assert_allclose(changed.document["stuck_frequency_hz"], by_hand, rtol=1e-7)
    assert (np.array(changed.document["stuck_frequency_hz"]) < frequency * (1 - 1e-6)).any()
    # A machine that cannot draw has all the rest, and is told why there are no pictures of the new modes.
    assert not any("mode" in file.name for file in map(Path, changed.document["files"]))
    assert "there are no pictures of modes: this machine draws nothing" in capsys.readouterr().err


def outcomes(model: RigModel, by_body: dict[str, ReducedBody]) -> RigReduction:
    meshed = model.meshed()
    tasks = list_reduction_tasks(model, meshed)
    result = [Outcome(value=by_body[task.inputs["body"]], seconds=0.0, cached=True) for task in tasks]
    return make_rig_reduction(model, meshed, tasks, result)


def test_a_mirror_image_is_what_its_own_reduction_gives(by_body: dict[str, ReducedBody]) -> None:
    for kind in ("damper", "decoupler"):
        own, image = by_body[f"{kind}_left"].rom, mirror_model(by_body[f"{kind}_right"].rom, f"{kind}_left")
        n = own.n_boundary
        for name in ("mass", "stiffness"):
            a, b = getattr(own, name)[:n, :n], getattr(image, name)[:n, :n]
            np.testing.assert_allclose(b, a, atol=1e-11 * np.abs(a).max())
        np.testing.assert_allclose(image.recovery[:, :n], own.recovery[:, :n], atol=1e-11)
        # Signs of modal coordinates are free: their effect on the boundary is not.
        a, b = (rom.mass[:n, n:] @ rom.mass[n:, :n] for rom in (own, image))
        np.testing.assert_allclose(b, a, atol=1e-9 * np.abs(a).max())
        np.testing.assert_allclose(image.fixed_interface_frequency, own.fixed_interface_frequency, rtol=1e-9)


def test_modes_are_the_lowest_of_all_bodies_or_as_many_as_each_is_given(
    model: RigModel, by_body: dict[str, ReducedBody]
) -> None:
    kept = {b: rom.fixed_interface_frequency for b, rom in outcomes(model, by_body).assembly.bodies.items()}
    every = np.sort(np.concatenate([one.rom.fixed_interface_frequency for one in by_body.values()]))
    np.testing.assert_allclose(np.sort(np.concatenate(list(kept.values()))), every[:N_MODE], rtol=1e-9)
    counts = {"blade": 9, "damper_left": 0, "decoupler_left": 4, "damper_right": 1, "decoupler_right": 2}
    given = outcomes(replace(model, n_mode=counts), by_body).assembly.bodies
    assert {body: rom.n_dof - rom.n_boundary for body, rom in given.items()} == counts
    assert replace(model, n_mode=counts).modes_of("decoupler_right") == 4  # enough for its mirror image too


def test_the_shaker_pushes_a_disc_about_the_named_point(model: RigModel, by_body: dict[str, ReducedBody]) -> None:
    place = model.meshed().coordinates["blade"]
    (pivot,) = place.mesh.nodes("excitation")
    centre = named_points(model.rig)["blade"]["excitation"]
    np.testing.assert_allclose(place.places[pivot], centre, atol=1e-12)
    rom = by_body["blade"].rom
    assert rom.boundary_node[rom.rows("excitation", 1)] == pivot
    # On the mesh the mean over the disc is the coordinate itself, in each direction.
    weights = find_disc_weights(
        place.mesh, find_outer_faces(place.mesh), centre, np.array([0.0, 1.0, 0.0]), model.rig.excitation_radius
    )
    on_mesh = rom.displacement(np.eye(rom.n_dof))
    mean = np.einsum("n,nim->im", weights, on_mesh)
    np.testing.assert_allclose(mean, np.eye(rom.n_dof)[rom.rows("excitation")], atol=1e-9)


def test_the_modes_of_all_bodies_can_be_checked(model: RigModel, by_body: dict[str, ReducedBody]) -> None:
    result = {body: by_body[body] for body in ("blade", "damper_right", "decoupler_right")}
    checked = check_bodies(model, result, Store(None), SilentProgress())
    assert set(checked) == set(result)
    assert all(item.n_missed == 0 and item.residual.max() < 1e-8 for item in checked.values())


def test_a_short_case_is_the_shipped_one(folder: Path, model: RigModel) -> None:
    shipped = open_case(RIG).case
    full = make_rig_model(shipped)
    # The shipped rig is shaken where its contacts slip, and its lines are crowned; all else is the default.
    like = replace(full.rig, blade=replace(full.rig.blade, excitation_height=model.rig.blade.excitation_height))
    for body in ("blade", "damper", "decoupler"):
        # Degrees become radians in decimals in a file, in floats in the defaults.
        assert asdict(getattr(like, body)) == pytest.approx(asdict(getattr(model.rig, body)), rel=1e-14, abs=0)
    assert full.material == model.material
    assert (full.element, full.size, full.n_mode) == ("hex20", 2.5e-3, 150)
    short = open_case(folder / "my.toml").case
    assert shipped.structure.contact.model_copy(update={"crowning": 0.0}) == short.structure.contact
    assert list_dead_weights(shipped) == list_dead_weights(short)
    assert shipped.structure.damping == short.structure.damping


def test_the_blade_of_the_rig_is_the_shipped_blade() -> None:
    blade, rig = open_case(BLADE).case.structure, make_rig_model(open_case(RIG).case)
    own = replace(rig.rig.blade, excitation_height=blade.blade.excitation_height)
    assert own == blade.blade.blade()
    assert rig.material == blade.material.material()


def test_a_pair_and_a_side_override_what_is_common(tmp_path: Path, short_rig: str) -> None:
    more = (
        '[structure.contact.right_decoupler]\nkt = "2 N/um"\nmu = 0.5\ngap_end = "3 um"\n'
        '[structure.dead_weight.left]\nforce = "40 N"\nshift = "-1 mm"\ninclination = "3 deg"\n'
    )
    (tmp_path / "a.toml").write_text(short_rig + more, encoding="utf-8")
    case = open_case(tmp_path / "a.toml").case
    pairs, weights = {pair.name: pair for pair in make_line_pairs(case, Rig())}, list_dead_weights(case)
    assert tuple(pairs) == tuple(mating_pairs(Rig()))
    own = pairs["right_decoupler"]
    assert (own.stiffness.normal, own.stiffness.tangential, own.friction_coefficient) == (8.5e6, 2e6, 0.5)
    assert own.gaps == pytest.approx(np.linspace(0, 3e-6, 7), abs=1e-18)
    # The same as an angle, over a line that is 12 mm long along the damper's axis and follows its cone.
    angle = f'gap_angle = "{np.rad2deg(np.arctan(3e-6 / 12e-3 * np.cos(np.deg2rad(8.53)))):.12g} deg"'
    (tmp_path / "b.toml").write_text(short_rig + more.replace('gap_end = "3 um"', angle), encoding="utf-8")
    other = next(
        pair for pair in make_line_pairs(open_case(tmp_path / "b.toml").case, Rig()) if pair.name == "right_decoupler"
    )
    assert other.gaps == pytest.approx(own.gaps, abs=1e-15)
    assert pairs["left_blade"].gaps is None
    assert (weights["left"].force, weights["left"].shift) == (40.0, -1e-3)
    assert weights["left"].inclination == pytest.approx(np.deg2rad(3), rel=1e-12)
    assert (weights["right"].force, weights["right"].shift, weights["right"].inclination) == (55.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("was", "put", "said"),
    [
        ('"8 mm"', '"50 mm"', r'my\.toml:10: structure\.mesh\.size = "50 mm": must lie between "1 mm" and "10 mm"'),
        (
            '"8 mm"',
            '"0.2 mm"',
            r'structure\.mesh\.size = "0\.2 mm": must lie between "1 mm" and "10 mm": "2\.5 mm" is a usual',
        ),
        ("modes = 40", "modes = -1", r":12: structure\.reduction\.modes = -1: must be greater than or equal to 0"),
        ("modes = 40", 'modes = "all"', r'structure\.reduction\.modes = "all": must be a whole number, without quotes'),
        (
            "modes = 40",
            "modes = {blade = 3, damper_left = 0, damper_right = 0, decoupler_left = 1, decouplers = 1}",
            r'structure\.reduction\.modes\.decouplers: unknown key; did you mean "decoupler_left"',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.contact.left_damper]\nkn = "1 N/um"',
            r":17: structure\.contact\.left_damper: unknown table",
        ),
        ('"8.5 N/um"', '"0 N/um"', r'structure\.contact\.kn = "0 N/um": must be greater than 0 N/m'),
        (
            "mu = 0.8",
            'mu = 0.8\ntangents = "none"',
            r'structure\.contact\.tangents = "none": must be "along" or "both"',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.dead_weight.left]\ninclination = "100 deg"',
            r'structure\.dead_weight\.left\.inclination = "100 deg": must lie between "-90 deg" and "90 deg"',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.dead_weight.left]\nshift = "9 mm"',
            r'structure\.dead_weight\.left\.shift = "9 mm": .* outside the damper\'s cylinder.*: give -6 mm to 6 mm',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.decoupler]\narm_angle = "80 deg"',
            r'structure\.decoupler\.arm_angle = "80 deg": the de-coupler cannot .* is not between 20 and 70 deg',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.damper]\ncone_half_angle = "60 deg"',
            r'structure\.damper\.cone_half_angle = "60 deg": the damper cannot .* is not between 0\.05 and 45 deg',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.decoupler]\ncone_half_angle = "9 deg"',
            r'structure\.decoupler\.cone_half_angle = "9 deg": the rig cannot .* they separate by .* um along the line',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.decoupler]\narms_meet = "20 mm"',
            r'structure\.decoupler\.arms_meet = "20 mm": .* exceeds contact_length = 12 mm \(lower the one',
        ),
        (
            "mu = 0.8",
            'mu = 0.8\n[structure.blade]\ncontact_length = "14 mm"',
            r'structure\.blade\.contact_length = "14 mm": the rig cannot be built: .* \(give all bodies the same\)',
        ),
        ('kind = "rig"\n', "", r'structure\.kind is missing; add kind = "plain"'),
        ('kind = "rig"', 'kind = "rog"', r':3: structure\.kind = "rog": must be .*"rig".*; did you mean "rig"'),
        ("0.3", "0.7", r"material\.poisson = 0\.7: poisson = 0\.7 must lie between -1 and 0\.5"),
    ],
)
def test_a_mistake_is_one_sentence_with_file_line_key_value_and_remedy(
    tmp_path: Path, short_rig: str, was: str, put: str, said: str
) -> None:
    assert was in short_rig
    file = tmp_path / "my.toml"
    file.write_text(short_rig.replace(was, put, 1), encoding="utf-8")
    with pytest.raises(CaseError, match=said):
        read_all(file)


def read_all(file: Path) -> None:
    case = open_case(file).case
    make_line_pairs(case, make_rig_model(case).rig)
    list_dead_weights(case)


@slow
def test_bodies_that_overlap_are_refused_by_the_command(tmp_path: Path, short_rig: str, stickslip: RigCommand) -> None:
    # A root block so thick that it reaches the lower arms, and contact so low that they reach it.
    blade = '[structure.blade]\ncontact_height = "50 mm"\nroot_thickness = "200 mm"\n'
    (tmp_path / "my.toml").write_text(short_rig + blade, encoding="utf-8")
    done = stickslip(tmp_path, "reduce", "my.toml", "--out", "out", "--quiet")
    assert done.returncode == 2
    assert "bodies overlap: blade and decoupler_left by" in done.stderr
    assert "my.toml:" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("command", "found", "remedy"),
    [("modes", "a rig", "`stickslip reduce` computes and draws"), ("table1", "one structure", "with [[model]] tables")],
)
def test_commands_that_are_not_for_rigs_say_so_in_one_sentence(
    folder: Path, stickslip: RigCommand, command: str, found: str, remedy: str
) -> None:
    done = stickslip(folder, command, "my.toml", "--out", "none")
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("my.toml:")
    assert f"case of {found}" in line
    assert remedy in line
