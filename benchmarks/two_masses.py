"""Case of two masses on a wall without contacts, and a campaign with hidden effects, which is diagnosed in seconds."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.prediction import Points, Predictor
from study.case.added import list_case_effects
from study.case.setup import read_case

#: Text of the case.
TWO_MASSES = """\
# Two masses on a wall, as drawn.
schema = 2
title = "Two masses"

[structure]
kind = "plain"
file = "chain.npz" # kg, N/m

[[place]]
name = "base"
dof = 0

[[place]]
name = "tip"
dof = 1

[[sensor]]
name = "tip"
place = "tip"

[[sensor]]
name = "base"
place = "base"

[[load]]
place = "base"

[numerical_error]
damping = "0 %" # another model makes the measurements

[harmonics]
highest = 3
"""
LEVELS, REPEATS, N_FREQUENCY, NOISE, FLOOR = (1.0, 4.0, 10.0), 5, 6, 2e-3, 1e-8


def write_two_masses(
    folder: Path, effects: Mapping[str, float], *, held_out: bool = True, case: str = TWO_MASSES
) -> Path:
    """Write the case ``chain.toml``, and a campaign of the structure with hidden effects and 1.1 times its damping.

    Parameters
    ----------
    folder
        Existing folder.
    effects
        Strength of each hidden effect, by name.
    held_out
        Whether a level and repeats are held out.
    case
        Text of the case.

    Returns
    -------
    Path of the case; the campaign is in ``campaign`` in the same folder.
    """
    mass, stiffness = np.diag([1.0, 0.5]), np.array([[5e4, -2e4], [-2e4, 2e4]])
    dofs = {"dof_body": ["chain"] * 2, "dof_node": [0, 1], "dof_direction": ["z", "z"]}
    np.savez(folder / "chain.npz", M=mass, C=2e-5 * stiffness, K=stiffness, **dofs)
    file = folder / "chain.toml"
    file.write_text(case, encoding="utf-8")
    setup = read_case(file).setup
    zeta = next(item for item in setup.calibration_parameters if item.name == "zeta")
    model = zeta.apply(setup.model, [1.1])
    known = list_case_effects(model, setup.effect_files, level=max(LEVELS), configurations=["jointed"])
    for name, strength in effects.items():
        model = known.effect(name).apply(model, [strength])
    resonance = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).min()) / (2 * np.pi)
    frequencies = resonance * np.linspace(0.99, 1.01, N_FREQUENCY)
    keys = [(a, f, s, k) for a in LEVELS for f in frequencies for s in (0, 1) for k in (1, 3)]
    level, frequency, sensor, harmonic = (np.array(column) for column in zip(*keys, strict=True))
    n, names = len(keys), np.array(["tip", "base"])
    points = Points(
        free=np.zeros(n, dtype=bool), level=level, frequency=frequency, sensor=names[sensor], harmonic=harmonic
    )
    exact = Predictor(points=points).predict(model).value
    random = np.random.default_rng(5)
    noise = random.standard_normal((REPEATS, n)) + 1j * random.standard_normal((REPEATS, n))
    value = exact + NOISE * np.abs(exact) * noise + FLOOR * np.roll(noise, 1, axis=1)
    columns = {"test": np.zeros(n, dtype=int), "level": level, "frequency": frequency, "sensor": sensor}
    table = Measurement(
        **{name: np.tile(column, REPEATS) for name, column in columns.items()},
        harmonic=np.tile(harmonic, REPEATS),
        order=np.arange(1, REPEATS * n + 1),
        repeat=np.repeat(np.arange(1, REPEATS + 1), n),
        sweep=np.ones(REPEATS * n, dtype=int),
        value=value.ravel(),
    )
    sensors = [
        MeasuredSensor(name=str(name), quantity="displacement", direction="z", place=str(name)) for name in names
    ]
    campaign = Campaign(
        title="Two masses, shaken",
        folder=Path(),
        sensors=tuple(sensors),
        tests=(Test(name="stepped"),),
        measurement=table,
        held_out=HeldOut(levels=(4.0,), repeats=(4, 5)) if held_out else HeldOut(),
    )
    write_campaign(campaign, folder / "campaign")
    return file
