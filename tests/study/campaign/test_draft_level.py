"""Levels of drafted runs: measured forces of one set point are one level, in both directions of sweep."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions
from study.campaign.repeat import group_levels
from tests.study.campaign.drafted_folder import drafted, receptance, write_csv

FREQUENCY = np.linspace(90.0, 110.0, 41)
#: Twice the misses are below the 5 % that neighbours may differ by, and the levels lie further apart than these.
MISS, APART = 0.02, 1.1


@pytest.mark.parametrize("seed", range(20))
def test_forces_that_miss_their_set_points_by_two_per_cent_are_grouped_by_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.1, 10.0) * np.cumprod(np.concatenate([[1.0], rng.uniform(APART, 3.0, 4)]))
    point = rng.permutation(np.repeat(np.arange(5), 4))
    level = points[point] * (1 + rng.uniform(-MISS, MISS, 20))
    groups = group_levels(level, np.zeros(20, dtype=np.bool_))
    assert [{*point[group].tolist()} for group in groups] == [{number} for number in range(5)]
    stated = rng.permutation(np.arange(20) % 4 == 0)
    level[stated] = points[point[stated]]
    groups = group_levels(level, stated)
    assert sorted(sorted({*point[group].tolist()}) for group in groups) == [[number] for number in range(5)]


def test_stated_levels_are_one_only_if_they_are_equal() -> None:
    assert group_levels(np.array([1.0, 1.01, 1.0]), np.ones(3, dtype=np.bool_)) == [[0, 2], [1]]


def test_forces_that_rise_by_little_steps_are_not_one_level() -> None:
    groups = group_levels(1.04 ** np.arange(10), np.zeros(10, dtype=np.bool_))
    assert max(len(group) for group in groups) == 3  # 1.04^2 is below 1.1, 1.04^3 above


def _write_runs(folder: Path, forces: dict[str, float]) -> None:
    x = 1 / (100.0**2 - FREQUENCY**2 + 2j * FREQUENCY)
    for name, force in forces.items():
        rows = np.column_stack([FREQUENCY, force + 0 * FREQUENCY, force * x.real, force * x.imag])
        text = "\n".join(",".join(map(repr, row)) for row in rows[:: -1 if "down" in name else 1].tolist())
        (folder / f"{name}.csv").write_text(f"f [Hz],force [N],x re [m],x im [m]\n{text}\n")


def _drafted(folder: Path) -> tuple[Any, ...]:
    return write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions())).suspicions


def test_sweeps_up_and_down_whose_forces_miss_one_set_point_are_one_level(tmp_path: Path) -> None:
    low = {"a_up": 0.981, "b_down": 1.019, "c_up": 0.999, "d_down": 0.992}
    _write_runs(tmp_path, low | {"e_up": 2.0, "f_down": 2.01, "g_up": 1.99, "h_down": 1.98})
    suspicions = _drafted(tmp_path)
    assert not any("lacks the level" in sentence for sentence in suspicions)
    table = read_campaign(tmp_path).measurement
    assert {*table.level.tolist()} == {1.0, 2.0}
    runs = {*zip(table.level.tolist(), table.sweep.tolist(), table.repeat.tolist(), strict=True)}
    assert runs == {(level, sweep, repeat) for level in (1.0, 2.0) for sweep in (1, -1) for repeat in (1, 2)}
    assert {*table.force.tolist()} >= {*low.values()}  # as measured


def test_the_level_in_a_name_is_the_set_point_of_the_force_near_it(tmp_path: Path) -> None:
    _write_runs(tmp_path, {"sine_1N_up": 0.97, "sine_1N_down": 1.035, "sine_1.05N_up": 1.05, "sine_4N_up": 3.0})
    _drafted(tmp_path)
    assert {*read_campaign(tmp_path).measurement.level.tolist()} == {1.0, 1.05, 3.0}


@pytest.mark.parametrize("name", ["f", "set", "stage"])
def test_what_is_constant_in_blocks_beside_a_frequency_is_the_level(tmp_path: Path, name: str) -> None:
    levels = np.repeat([1.0, 1.5, 2.0], len(FREQUENCY))
    amplitude = levels * np.tile(np.abs(receptance(FREQUENCY)), 3)
    write_csv(tmp_path / "sweep.csv", f"{name},frequency_Hz,amplitude", levels, np.tile(FREQUENCY, 3), amplitude)
    campaign, manifest = drafted(tmp_path)
    assert [run["level"] for run in manifest["run"]] == [1.0, 1.5, 2.0]
    assert any(f'"{name}"' in sentence and "level" in sentence for sentence in campaign.draft.assumptions())


@pytest.mark.parametrize(("name", "values"), [("pass", [1, 2, 3]), ("f2 [Hz]", [10, 20, 30]), ("offset", [-1, 0.5, 2])])
def test_numbers_of_passes_and_frequencies_are_no_levels(tmp_path: Path, name: str, values: list[float]) -> None:
    column = np.repeat(np.array(values, dtype=float), len(FREQUENCY))
    amplitude = np.tile(np.abs(receptance(FREQUENCY)), 3)
    write_csv(tmp_path / "sweep.csv", f"{name},frequency_Hz,amplitude", column, np.tile(FREQUENCY, 3), amplitude)
    (run,) = drafted(tmp_path)[1]["run"]
    assert run["level"] == 1.0


def test_a_measured_force_is_the_level_beside_what_is_constant_in_blocks(tmp_path: Path) -> None:
    torque, force = np.repeat([5.0, 7.5], len(FREQUENCY)), 3.0 * np.ones(2 * len(FREQUENCY))
    columns = torque, np.tile(FREQUENCY, 2), force, 3.0 * np.tile(np.abs(receptance(FREQUENCY)), 2)
    write_csv(tmp_path / "sweep.csv", "torque,frequency [Hz],force [N],tip [m]", *columns)
    assert not any("rows" in run for run in drafted(tmp_path)[1]["run"])
