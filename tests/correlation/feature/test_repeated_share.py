"""Noise of a campaign of which a few points alone were read twice."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.feature.observation import arrange_campaign
from correlation.feature.table import average_campaign
from study.compare.suspicions import _suspect_single_repeat

NOISE = 1e-8


def one_sweep(repeated: int) -> Campaign:
    """A sweep of 81 points over a resonance; the first ones were read again, and are 5 % off then."""
    rng = np.random.default_rng(3)
    frequency = np.linspace(80.0, 120.0, 81)
    value = 1e-6 / (1 - (frequency / 100) ** 2 + 0.1j * frequency / 100)
    value = value + NOISE * (rng.normal(size=81) + 1j * rng.normal(size=81))
    rows = np.concatenate([np.arange(81), np.arange(repeated)])
    again = np.arange(len(rows)) >= 81
    same = np.zeros(len(rows), dtype=int)
    return Campaign(
        title="", folder=Path(), tests=(Test(name="sine"),), held_out=HeldOut(),
        sensors=(MeasuredSensor(name="tip", quantity="displacement", direction="z", place="tip"),),
        measurement=Measurement(
            test=same, order=np.arange(len(rows)), repeat=1 + again, sweep=same + 1, level=same + 1.0,
            frequency=frequency[rows], sensor=same, harmonic=same + 1, value=value[rows] * np.where(again, 1.05, 1.0),
        ),
    )  # fmt: skip


@pytest.mark.parametrize(("repeated", "tells"), [(0, False), (1, False), (40, True)])
def test_noise_is_that_of_the_curve_unless_many_points_were_repeated(repeated: int, tells: bool) -> None:
    made = one_sweep(repeated)
    table = average_campaign(made)
    # Where it is read once, the curve tells the noise within a factor of two; 5 % of 1e-5 at the peak is far more.
    peak = np.argmax(np.abs(table.value))
    assert (table.deviation[peak] > 4 * NOISE) == tells
    assert bool(list(_suspect_single_repeat(made))) == (not tells)
    # A diagnosis takes the noise that the curve tells, and with 40 repeated points that which repeats tell.
    assert np.isfinite(arrange_campaign(made).noise).all() == (not tells)
