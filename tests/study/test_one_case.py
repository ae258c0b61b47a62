"""One file goes through every command: a coarse rig is reduced, solved, bounded, compared, mended, and put back."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.model import Model
from correlation.prediction import Points, Predictor
from fe.dense_modes import compute_dense_modes
from pipeline.store import Store
from reduction.stuck import stuck_stiffness
from study import cli
from study.case.added import list_case_effects
from study.case.setup import read_case
from study.run_context import silent_run

#: Ten grams on the tip of a blade whose modal mass is 0.2 kg.
HIDDEN = 0.01
LEVELS, REPEATS, NOISE, FLOOR = (0.5, 1.0), 3, 5e-3, 1e-9
#: What the rig is shown by, and measured by: motions of places that it names, and the force of a line.
MORE = """\
[[sensor]]
name = "tip"
place = "tip"
[[sensor]]
name = "force"
line = "left_blade"
component = "normal"
[harmonics]
highest = 1
samples = 32
"""
CHANNELS = (
    MeasuredSensor(name="tip", quantity="displacement", direction="y", place="tip"),
    MeasuredSensor(name="force", quantity="contact force", line="left_blade", component="normal"),
)
#: Sensor and harmonic of each reading of a level and frequency.
READ = ((0, 1), (1, 0), (1, 1))


def complete(folder: Path) -> Model:
    return read_case(folder / "rig.toml", run=replace(silent_run(), store=Store(folder / "cache"))).model


def bending(model: Model) -> float:
    """The first mode that moves the tip by a force on the blade, all contacts stuck [Hz]."""
    modes = compute_dense_modes(model.system.mass, stuck_stiffness(model.system.stiffness, model.system.joints))
    eigenvalue, shapes = modes.lambda_[:20], modes.mode_shapes[:, :20]
    moved = np.abs((model.places["tip"] @ shapes) * (model.places["excitation"] @ shapes)) / eigenvalue
    return float(np.sqrt(eigenvalue[np.argmax(moved > 0.05 * moved.max())]) / (2 * np.pi))


def measured(model: Model, around: float) -> Campaign:
    """Noisy readings of a model about a frequency."""
    frequencies = around * np.array([0.97, 0.99, 0.995, 1.0, 1.01])
    keys = [(level, frequency, *item) for level in LEVELS for frequency in frequencies for item in READ]
    level, frequency, sensor, harmonic = (np.array(column) for column in zip(*keys, strict=True))
    n, names = len(keys), np.array([item.name for item in CHANNELS])
    points = Points(
        free=np.zeros(n, dtype=bool), level=level, frequency=frequency, sensor=names[sensor], harmonic=harmonic
    )
    exact = Predictor(points=points).predict(model).value
    random = np.random.default_rng(5)
    noise = random.standard_normal((REPEATS, n)) + 1j * random.standard_normal((REPEATS, n))
    value = exact + NOISE * np.abs(exact) * noise + np.where(sensor == 1, 1e-3, FLOOR) * np.roll(noise, 1, axis=1)
    value = np.where(harmonic == 0, value.real, value)
    columns = {"test": np.zeros(n, dtype=int), "level": level, "frequency": frequency, "sensor": sensor}
    table = Measurement(
        **{name: np.tile(column, REPEATS) for name, column in columns.items()},
        harmonic=np.tile(harmonic, REPEATS),
        order=np.arange(1, REPEATS * n + 1),
        repeat=np.repeat(np.arange(1, REPEATS + 1), n),
        sweep=np.ones(REPEATS * n, dtype=int),
        value=value.ravel(),
    )
    return Campaign(
        title="Rig, shaken",
        folder=Path(),
        sensors=CHANNELS,
        tests=(Test(name="stepped"),),
        measurement=table,
        held_out=HeldOut(),
    )


def upper(document: dict[str, Any]) -> float:
    """Upper limit at the one frequency and level [um]."""
    return float(document["levels"][0]["upper"]["value"])


def deviations(document: dict[str, Any]) -> float:
    """Misfit of the training data, in standard deviations."""
    return float(document["sets"]["training"]["standard_deviations"])


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers alone: each command has tests of its pictures, which take longer than all that is tested here."""
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])
    monkeypatch.setattr("study.compare.run.draw_pictures", lambda *_: {})
    monkeypatch.setattr("study.kind.rig.reduce._draw_pictures", lambda *_: [])
    monkeypatch.setattr("study.kind.rig.solve.draw_film", lambda *_: [])


@pytest.mark.usefixtures("undrawn")
def test_one_case_goes_through_every_command(
    at_home: Path, short_rig: str, reduced_rig: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(reduced_rig, at_home / "cache")

    def command(*words: str) -> dict[str, Any]:
        capfd.readouterr()
        assert cli.main([*words, "--out", "out", "--json"]) == 0
        return dict(json.loads(capfd.readouterr().out))

    case = at_home / "rig.toml"
    case.write_text(short_rig + MORE, encoding="utf-8")
    reduced = command("reduce", "rig.toml")
    drawn = complete(at_home)
    assert reduced["n_reduced"] == drawn.system.n_dof
    first = bending(drawn)
    assert np.abs(np.array(reduced["stuck_frequency_hz"]) / first - 1).min() < 1e-6
    case.write_text(
        short_rig
        + MORE
        + f'[sweep]\nfrom = "{0.95 * first:.3f} Hz"\nto = "{1.02 * first:.3f} Hz"\nlevels = [0.5]\n'
        + f'[limits]\nfrequencies = ["{first:.3f} Hz"]\npopulation = 2\nsamples = 2\n',
        encoding="utf-8",
    )
    before = case.read_bytes()
    hidden = list_case_effects(drawn, (), level=max(LEVELS), configurations=["jointed"]).effect("mass at tip")
    heavy = hidden.apply(drawn, [HIDDEN])
    write_campaign(measured(heavy, bending(heavy)), at_home / "campaign")

    (light,) = command("solve", "rig.toml")["curves"]
    # At 0.5 N the contacts stick.
    assert light["peak_frequency_hz"] == pytest.approx(first, rel=2e-3)
    bounds = command("limits", "rig.toml")
    # All contacts stick: histories leave no band, at the top of the curve.
    assert upper(bounds) == pytest.approx(light["peak_amplitude"], rel=1e-2)
    misfit = command("compare", "rig.toml", "campaign")

    assert cli.main(["add", "mass at tip", "--value", "10 g", "--case", "rig.toml", "--quiet"]) == 0
    (loaded,) = command("solve", "rig.toml")["curves"]
    assert loaded["peak_frequency_hz"] == pytest.approx(bending(heavy), rel=2e-3)
    assert loaded["peak_frequency_hz"] < 0.99 * light["peak_frequency_hz"]
    np.testing.assert_allclose(complete(at_home).system.mass, heavy.system.mass, rtol=1e-12)
    moved = command("limits", "rig.toml")
    corrected = command("compare", "rig.toml", "campaign")
    # Far above the resonance of the heavier blade.
    assert upper(moved) < 0.1 * upper(bounds)
    # Noise, and next to nothing else, is left.
    assert deviations(corrected) < 1.5 < 5 < deviations(misfit)

    assert cli.main(["undo", "--case", "rig.toml", "--quiet"]) == 0
    assert case.read_bytes() == before
    (again,) = command("solve", "rig.toml")["curves"]
    assert again == light
