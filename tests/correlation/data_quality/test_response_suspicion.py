"""Mistakes in frequency responses and modes: named with evidence where one was made, and nowhere else."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.read_campaign import read_campaign
from correlation.data_quality.response import find_response_suspicions
from correlation.data_type.mode import MeasuredMode, compute_linear_modes
from correlation.data_type.mode_set import correct_modes
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from reduction.jointed_system import JointedSystem

NAMES = tuple("abcde")


def chain(seed: int = 0, scatter: float = 0.0) -> Model:
    """Five masses on springs between two walls, the springs off by a scatter."""
    springs = 4e4 * np.array([1.0, 1.4, 0.8, 1.2, 1.0, 0.7])
    springs *= np.exp(scatter * np.random.default_rng(seed).standard_normal(6))
    stiffness = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    force = np.zeros((2, 5), dtype=np.complex128)
    force[1, 0] = 1.0
    system = JointedSystem(
        mass=np.eye(5), damping=1e-4 * stiffness, stiffness=stiffness, joints=[], harmonic_force=force
    )
    rows = zip(NAMES, np.eye(5), strict=True)
    return Model(system=system, sensors=tuple(Sensor(name=name, row=row) for name, row in rows))


def measured(model: Model, seed: int, count: int = 4) -> list[MeasuredMode]:
    """Its modes with 2 % of noise in the shapes."""
    frequency, _, shapes = compute_linear_modes(model, "jointed")
    noise = 0.02 * np.random.default_rng(seed).standard_normal(shapes.shape) * np.abs(shapes).max()
    return [
        MeasuredMode(
            name=f"mode {number}", configuration="jointed", frequency=float(frequency[number]),
            frequency_deviation=0.01, sensors=NAMES, shape=(shapes + noise)[:, number].astype(np.complex128),
        )
        for number in range(count)
    ]  # fmt: skip


def changed(modes: list[MeasuredMode], change: NDArray[np.float64], factor: float = 1.0) -> list[MeasuredMode]:
    return [replace(mode, shape=change @ mode.shape, frequency=factor * mode.frequency) for mode in modes]


@pytest.mark.parametrize("seed", range(10))
def test_right_modes_of_a_structure_that_differs_are_not_suspected(seed: int) -> None:
    assert not find_response_suspicions(chain(), measured(chain(seed, 0.15), seed))


@pytest.mark.parametrize("seed", range(5))
def test_swapped_and_reversed_sensors_are_named_and_do_not_turn_the_pairs(seed: int) -> None:
    random = np.random.default_rng(300 + seed)
    modes = measured(chain(seed, 0.03), seed)
    i, j = random.choice(5, 2, replace=False)
    swap, reverse = np.eye(5), np.eye(5)
    swap[[i, j]] = swap[[j, i]]
    reverse[i, i] = -1
    for change, names in ((swap, {NAMES[i], NAMES[j]}), (reverse, {NAMES[i]})):
        wrong = changed(modes, change)
        (result,) = find_response_suspicions(chain(), wrong)
        assert {name for name in NAMES if f'"{name}"' in result.where} == names
        corrected = correct_modes(chain(), wrong)
        # A reversed sensor is told up to the sign of the whole shape.
        for one, right in zip(corrected, modes, strict=True):
            np.testing.assert_allclose(one.shape, right.shape)


@pytest.mark.parametrize(("factor", "unit"), [(2 * np.pi, "rad/s"), (1 / (2 * np.pi), "Hz")])
@pytest.mark.parametrize("has_shape", [True, False])
def test_one_factor_of_two_pi_on_all_frequencies_is_suspected(factor: float, unit: str, has_shape: bool) -> None:
    modes = changed(measured(chain(), 1, 2), np.eye(5), factor)
    if not has_shape:
        modes = [replace(mode, sensors=(), shape=np.zeros(0, dtype=np.complex128)) for mode in modes]
    (result,) = find_response_suspicions(chain(), modes)
    assert f'"{unit}"' in result.sentence


FREQUENCY = np.arange(20.0, 120.0, 0.1)


def campaign(folder: Path, values: dict[str, NDArray[Any]], units: str) -> list[str]:
    """Suspicions of a campaign of one set of frequency responses, as amplitude and phase."""
    columns = ["f"] + [f"{part}_{name}" for name in values for part in ("a", "p")]
    table = [FREQUENCY] + [part for value in values.values() for part in value]
    np.savetxt(folder / "h.csv", np.transpose(table), delimiter=",", header=",".join(columns), comments="")
    sensors = "".join(
        f'[[sensor]]\nname = "{name}"\nquantity = "displacement"\nplace = "{name}"\ndirection = "z"\n'
        for name in values
    )
    lines = "".join(
        f'{name} = {{ amplitude = "a_{name}", phase = "p_{name}", unit = "m/N", phase_unit = "{units}" }}\n'
        for name in values
    )
    (folder / "campaign.toml").write_text(
        f'schema = 1\n{sensors}[[frf]]\nname = "hammer"\nfile = "h.csv"\nconfiguration = "jointed"\n'
        f'[frf.columns]\nfrequency = {{ column = "f", unit = "Hz" }}\n{lines}'
    )
    return [str(suspicion) for suspicion in read_campaign(folder).suspicions]


def receptances() -> dict[str, NDArray[Any]]:
    random = np.random.default_rng(9)
    omega, own = 2 * np.pi * FREQUENCY[:, None], 2 * np.pi * np.array([45.0, 80.0])
    parts = 1 / (own**2 - omega**2 + 0.02j * own * omega)
    noise = 1e-3 * np.abs(parts).max() * (random.standard_normal((2, len(omega), 2)) @ np.array([1, 1j]))
    return {"a": parts @ [1.0, 1.0] + noise[0], "b": parts @ [1.0, -0.6] + noise[1]}


def test_mistakes_of_frequency_responses_are_told_from_right_ones(tmp_path: Path) -> None:
    right = {name: (np.abs(h), np.angle(h)) for name, h in receptances().items()}
    assert not campaign(tmp_path, right, "rad")
    conjugate = campaign(tmp_path, {name: (size, -phase) for name, (size, phase) in right.items()}, "rad")
    assert any("convention.time" in sentence for sentence in conjugate)
    degrees = campaign(tmp_path, {name: (size, np.degrees(phase)) for name, (size, phase) in right.items()}, "rad")
    assert sum("phase_unit" in sentence for sentence in degrees) == 1
    dead = campaign(tmp_path, {**right, "c": (np.full(1000, 1e-6), np.full(1000, 0.3))}, "rad")
    assert [sentence for sentence in dead if "dead" in sentence and '"c"' in sentence]


def test_a_record_without_its_force_is_refused_with_its_place_once(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "h.csv", np.zeros((50, 2)), delimiter=",", header="t,x", comments="")
    (tmp_path / "campaign.toml").write_text(
        'schema = 1\n[[sensor]]\nname = "a"\nquantity = "displacement"\nplace = "a"\ndirection = "z"\n'
        '[[frf]]\nname = "noise"\nfile = "h.csv"\nconfiguration = "free"\n[frf.columns]\ntime = "t"\n'
        'a = { column = "x", unit = "m" }\n'
    )
    with pytest.raises(CampaignError, match=r"columns\.force") as raised:
        read_campaign(tmp_path)
    assert str(raised.value).count("campaign.toml") == 1
