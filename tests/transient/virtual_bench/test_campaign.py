"""Campaigns of the bench: files, seeds, noise, and what hidden effects do to the data."""

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.unit_strengths import features, noise_variance, refitted, unit_strength
from fe.dense_modes import compute_dense_modes
from transient.errors import TransientError
from transient.state import TransientState
from transient.virtual_bench.beam import BeamParameters, reduced_beam
from transient.virtual_bench.campaign import FORCE_FLOOR, NOISE, Sweep, sweeps, with_noise
from transient.virtual_bench.effect import KINDS, NOTHING, HiddenEffect, insert_effect
from transient.virtual_bench.hidden_effect import CampaignPoints, make_campaign, random_effect, read_unit_strengths
from transient.virtual_bench.sweep import SweepReadings

SMALL = CampaignPoints(
    levels=(3.0, 5.0), frequencies=(460.0, 470.0, 476.0), free_frequencies=(91.0, 91.7, 92.4), n_repeat=2
)
DRAWN = BeamParameters()


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def values(table: list[dict[str, str]], **wanted: str) -> np.ndarray:
    result = [row for row in table if all(row[name] == value for name, value in wanted.items())]
    return np.array([complex(float(row["real"]), float(row["imag"])) for row in result])


def test_the_same_seed_gives_the_same_bytes_and_another_others(tmp_path: Path) -> None:
    truths = [make_campaign(tmp_path / name, seed=seed, points=SMALL) for name, seed in (("a", 7), ("b", 7), ("c", 8))]
    for file in ("campaign.toml", "stepped.csv", "free.csv"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    assert (tmp_path / "a" / "stepped.csv").read_bytes() != (tmp_path / "c" / "stepped.csv").read_bytes()
    assert truths[0] == truths[1]
    assert truths[0] != truths[2]


def test_a_folder_holds_every_reading_once_and_no_truth(tmp_path: Path) -> None:
    truth = make_campaign(tmp_path, seed=3, kind="cubic", points=SMALL)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["campaign.toml", "free.csv", "stepped.csv"]
    text = "".join(file.read_text(encoding="utf-8") for file in tmp_path.iterdir())
    for word in ("cubic", "hidden", "seed", "strength", f"{truth.effect.strength:.4e}"):
        assert word not in text
    manifest = tomllib.loads((tmp_path / "campaign.toml").read_text(encoding="utf-8"))
    assert [sensor["name"] for sensor in manifest["sensor"]][:2] == ["tip", "slot"]
    assert manifest["held_out"] == {"levels": [5.0], "repeats": []}
    stepped, free = rows(tmp_path / "stepped.csv"), rows(tmp_path / "free.csv")
    n_point = 2 * 2 * 2 * 3
    assert len(stepped) == n_point * (4 * 2 + 4 * 3)
    assert len(free) == n_point * 4 * 2
    keys = [tuple(row.values())[1:8] for row in stepped]
    assert len(set(keys)) == len(keys)
    orders = [int(row["order"]) for row in stepped]
    assert orders == sorted(orders)
    assert set(orders) == set(range(1, n_point + 1))
    assert truth.n_point == 2 * n_point
    truth.save(tmp_path.parent / "truth.json")


def test_down_sweeps_list_the_frequencies_backwards(tmp_path: Path) -> None:
    make_campaign(tmp_path, seed=1, kind=NOTHING, points=SMALL)
    table = [row for row in rows(tmp_path / "free.csv") if row["sensor"] == "tip" and row["harmonic"] == "1"][:6]
    assert [row["frequency"] for row in table] == ["91", "91.7", "92.4", "92.4", "91.7", "91"]
    assert [row["sweep"] for row in table] == ["up"] * 3 + ["down"] * 3


def test_repeats_scatter_by_their_noise_where_nothing_else_does() -> None:
    random = np.random.default_rng(5)
    ones = SweepReadings(
        motion=np.full((4000, 4, 2), 1.0 + 0j),
        force=np.full((4000, 4, 3), 2.0 + 0j),
        slip_share=np.zeros(4000),
        n_period=np.ones(4000, dtype=np.int64),
        periodic=np.ones(4000, dtype=bool),
        slider=np.zeros((4000, 0)),
        final=TransientState(displacement=np.zeros(1), velocity=np.zeros(1), slider=np.zeros(0)),
    )
    noisy = with_noise(ones, random)
    # Mean squares of 32000 and 16000 numbers: within 2 % at three standard deviations.
    assert np.sqrt(np.mean(np.abs(noisy.motion - 1) ** 2)) == pytest.approx(NOISE, rel=0.02)
    assert noisy.force[..., 0].imag.any() is np.False_
    assert noisy.force[..., 0].real.std() == pytest.approx(FORCE_FLOOR, rel=0.03)
    dynamic = np.sqrt(np.mean(np.abs(noisy.force[..., 1:] - 2) ** 2))
    assert dynamic == pytest.approx(np.hypot(FORCE_FLOOR, 2 * NOISE), rel=0.03)


def test_histories_and_jitter_do_not_depend_on_what_is_hidden() -> None:
    beam = reduced_beam()
    points = replace(SMALL, levels=(0.01,), n_repeat=2)
    static = [
        [
            sweep.readings.force[0, :, 0].real
            for sweep in sweeps(beam, DRAWN, effect, points, np.random.default_rng(1))
            if sweep.configuration == "jointed"
        ]
        for effect in (HiddenEffect(kind=NOTHING), HiddenEffect(kind="mass", place="tip", strength=1e-6))
    ]
    # Sticking throughout: the static forces are those that the random start left.
    np.testing.assert_allclose(static[0], static[1], rtol=1e-6)
    assert abs(static[0][0][0] - static[0][1][0]) > 0.01


def test_a_planted_mass_lowers_the_measured_free_resonance() -> None:
    beam, mass = reduced_beam(), 2e-3
    jointed, free = insert_effect(beam, DRAWN, HiddenEffect(kind="mass", place="tip", strength=mass))
    f0 = compute_dense_modes(beam.mass, beam.stiffness).frequency[0]
    # 3 f^2 phi^4 is left out: (4 m / M)^2 = 3e-4 of the frequency.
    expected = f0 * (1 - 2 * mass / 0.471)
    grid = tuple(np.linspace(0.98, 1.0, 41) * f0)
    points = CampaignPoints(levels=(1.0,), frequencies=(460.0,), free_frequencies=grid, n_repeat=1)
    effect = HiddenEffect(kind="mass", place="tip", strength=mass)
    sweep = list(sweeps(beam, DRAWN, effect, points, np.random.default_rng(0), jitter=0.0))[1]
    tip = np.abs(sweep.readings.motion[:41, 0, 0])
    assert grid[int(tip.argmax())] == pytest.approx(expected, rel=6e-4)
    np.testing.assert_array_equal(jointed.mass, free.mass)


@pytest.mark.parametrize(("kind", "place"), [(kind, place) for kind, places in KINDS.items() for place in places])
def test_every_effect_has_a_unit_strength_and_changes_the_specimen_smoothly(kind: str, place: str) -> None:
    assert read_unit_strengths()[kind][place] > 0
    beam = reduced_beam()
    nothing = insert_effect(beam, DRAWN, HiddenEffect(kind=NOTHING))
    vanishing = insert_effect(beam, DRAWN, HiddenEffect(kind=kind, place=place, strength=0.0))
    for a, b in zip(nothing, vanishing, strict=True):
        np.testing.assert_array_equal(a.mass, b.mass)
        np.testing.assert_array_equal(a.stiffness, b.stiffness)
        np.testing.assert_array_equal(a.static, b.static)
    strong = insert_effect(beam, DRAWN, HiddenEffect(kind=kind, place=place, strength=1.0))
    assert repr(strong[0]) != repr(nothing[0])


def test_drawn_strengths_lie_between_one_and_four_units() -> None:
    units = read_unit_strengths()
    effects = [random_effect(np.random.default_rng(seed)) for seed in range(200)]
    ratio = np.array([abs(item.strength) / units[item.kind][item.place] for item in effects])
    assert ratio.min() >= 1.0
    assert ratio.max() <= 4.0
    # Log-uniform: half of them below 2; 200 draws have a standard deviation of 0.035 there.
    assert np.mean(ratio < 2.0) == pytest.approx(0.5, abs=0.11)
    assert {item.kind for item in effects} == set(KINDS)
    assert {np.sign(item.strength) for item in effects if item.kind == "preload"} == {-1.0, 1.0}


def test_unknown_effects_are_refused() -> None:
    with pytest.raises(TransientError, match='"rust" is not one of mass, spring'):
        HiddenEffect(kind="rust")
    with pytest.raises(TransientError, match='"mass" at "left" is not known: give tip'):
        HiddenEffect(kind="mass", place="left")
    with pytest.raises(TransientError, match=r"strength -0\.1 of"):
        HiddenEffect(kind="mass", place="tip", strength=-0.1)


def test_the_variance_of_features_is_that_of_noisy_campaigns() -> None:
    beam = reduced_beam()
    points = replace(SMALL, levels=(5.0,), n_repeat=1)
    clean = list(sweeps(beam, DRAWN, HiddenEffect(kind=NOTHING), points, np.random.default_rng(2)))
    random = np.random.default_rng(3)

    def noisy() -> list[Sweep]:
        return [replace(item, readings=with_noise(item.readings, random)) for item in clean]

    drawn = [features(noisy()) for _ in range(800)]
    variance = noise_variance(clean, 1)
    # 800 draws: standard deviations within 2.5 % each, the worst of 104 within four times that.
    np.testing.assert_allclose(np.std(drawn, axis=0), np.sqrt(variance), rtol=0.12)


def test_a_refit_leaves_what_no_parameter_explains() -> None:
    random = np.random.default_rng(4)
    basis = np.linalg.qr(random.standard_normal((20, 4)))[0]
    slopes, beyond = basis[:, :3], basis[:, 3]

    def change(p: np.ndarray) -> np.ndarray:
        return slopes @ (p - [1.0, -2.0, 0.5] + 0.05 * (p - [1.0, 0.0, 0.0]) ** 2) + 3.0 * beyond

    # Four steps of a method that converges faster than linearly from slopes 10 % off.
    assert refitted(change, slopes * 1.1) == pytest.approx(3.0, rel=1e-3)


def test_the_unit_strength_of_a_linear_norm_is_exact() -> None:
    value = unit_strength("mass", lambda strength: float(np.hypot(3e6 * strength, 7.0)), 7.0)
    assert value == pytest.approx(5.0 / 3e6)
