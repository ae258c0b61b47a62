"""Frequency responses of the free structure take part in a diagnosis."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.response_modes import read_modes
from study.case.setup import read_case
from study.diagnose.run import diagnose_file
from tests.slow import slow

HIDDEN = 0.006  # kg at the tip


@slow
def test_a_response_of_the_free_structure_shows_the_mass_that_is_missing(two_masses: Callable[..., Path]) -> None:
    case, folder = two_masses({"mass at tip": HIDDEN}), Path("campaign")
    campaign = read_campaign(folder)
    system = read_case(case, campaign).setup.model.without_contacts().system
    mass = system.mass + np.diag([0.0, HIDDEN])
    natural = np.sqrt(eigh(system.stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    line = np.linspace(0.8 * natural[0], 1.2 * natural[-1], 801)
    impedance = [system.stiffness - w**2 * mass + 1j * w * 1.1 * system.damping for w in 2 * np.pi * line]
    value = np.array([np.linalg.solve(item, [1.0, 0.0]) for item in impedance]).T
    random = np.random.default_rng(7)
    noise = random.standard_normal((2, *value.shape))
    sensors = [sensor for name in ("base", "tip") for sensor in campaign.sensors if sensor.name == name]
    response = MeasuredResponse(
        name="hammer", test=-1, configuration="free", sensors=("base", "tip"), frequency=line,
        value=value * (1 + 0.003 * (noise[0] + 1j * noise[1])), units=("m per N",) * 2,
        coherence=np.ones(value.shape), level=None, repeat=1,
    )  # fmt: skip
    result = diagnose_file(case, replace(campaign, data=(read_modes(response, sensors),)), folder).last
    assert [test.name for test in result.campaign.tests] == [*(test.name for test in campaign.tests), "hammer"]
    best = result.best
    assert best is not None
    assert best.name == "mass at tip"
    # Its interval is that wide.
    assert best.strength == pytest.approx(HIDDEN, rel=0.02)
