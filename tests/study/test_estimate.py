"""First estimates against the model that made the campaign, and what is written into the case."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.data_type.loop import ForceLoop
from correlation.data_type.mode import MeasuredMode, linear_modes
from correlation.model import Model
from correlation.signal.loop import analyse_loop
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from study.cli import main
from study.estimate.estimate import Estimate, combine, estimate_all, line_stiffness
from tests.correlation.conftest import make_campaign, make_small


@pytest.fixture(scope="module")
def small() -> Model:
    return make_small()


def of(estimates: tuple[Estimate, ...], parameter: str) -> list[Estimate]:
    return [item for item in estimates if item.parameter == parameter]


def modes(model: Model) -> list[MeasuredMode]:
    """The lowest elastic mode of both configurations, as a modal test states it."""
    found = []
    for configuration in ("jointed", "free"):
        frequency, damping, _ = linear_modes(model, configuration)
        number = int(np.flatnonzero(frequency > 0.5)[0])
        found.append(
            MeasuredMode(
                name=configuration,
                configuration=configuration,
                frequency=float(frequency[number]),
                frequency_deviation=1e-4 * float(frequency[number]),
                damping=float(damping[number]),
                damping_deviation=0.01 * float(damping[number]),
            )
        )
    return found


def test_stiffness_comes_from_stuck_and_free_resonances(small: Model) -> None:
    stiffer = scale_contacts(small, dict.fromkeys(small.lines, 1.3), "tangential_stiffness")
    campaign = make_campaign(small)
    nothing = replace(campaign, measurement=campaign.measurement.where(np.zeros(len(campaign.measurement), dtype=bool)))
    estimates, _ = estimate_all(replace(nothing, data=tuple(modes(stiffer))), small)
    for item in of(estimates, "kt"):
        assert item.value == pytest.approx(1.3 * line_stiffness(small, item.where), rel=1e-3)
        assert item.low < item.value < item.high
    (free,) = [item for item in of(estimates, "zeta") if item.where == "free"]
    assert free.factor == pytest.approx(1.0, rel=1e-6)


def test_the_friction_coefficient_is_a_lower_bound(small: Model) -> None:
    estimates, _ = estimate_all(make_campaign(small), small)
    truth = max(contact.friction_coefficient for line in small.lines for contact in find_contacts(small, line))
    for item in of(estimates, "mu"):
        assert item.low < truth
        assert item.high == np.inf
        assert "lower bound" in item.bias[0]


def test_a_loop_gives_the_stiffness_of_its_line(small: Model) -> None:
    line = next(iter(small.lines))
    stiffness, limit = 1.2 * line_stiffness(small, line), 5.0
    x = 4 * limit / stiffness * np.cos(np.linspace(0, 12 * np.pi, 6001))
    slider, force = 0.0, []
    for at in x:
        slider = min(max(slider, at - limit / stiffness), at + limit / stiffness)
        force.append(stiffness * (at - slider))
    loop = ForceLoop(
        name="loop", displacement=x, force=np.array(force), loops=analyse_loop(x, force), frequency=10.0, line=line,
        sensor="tip", level=1.0,
    )  # fmt: skip
    estimates, _ = estimate_all(replace(make_campaign(small), data=(loop,)), small)
    (item,) = of(estimates, "kt")
    # Without noise the slope of the stick branch is exact but for the corner.
    assert item.value == pytest.approx(stiffness, rel=0.02)
    combined = combine(estimates, "kt")
    assert combined is not None
    assert combined.factor == pytest.approx(1.2, rel=0.02)


def test_what_cannot_be_estimated_says_what_to_measure(small: Model) -> None:
    campaign = make_campaign(small)
    motions = np.array([item.line is None for item in campaign.sensors])
    alone = replace(campaign, measurement=campaign.measurement.where(motions[campaign.measurement.sensor]))
    _, missing = estimate_all(alone, small)
    assert any(text.startswith("mu:") for text in missing)
    assert any(text.startswith("preload:") for text in missing)


CASE = """schema = 2
# The first draft.
[structure]
kind = "plain"
file = "chain.npz"
[[structure.dof]]
direction = "x"
[[structure.dof]]
direction = "x"
[[sensor]]
name = "a"
dof = 0
[accepted]
zeta = "20 %"  # from experience
"""


def test_factors_are_written_into_the_case_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    np.savez(tmp_path / "chain.npz", M=np.eye(2), K=stiffness, C=1e-4 * stiffness)
    case, folder = tmp_path / "chain.toml", tmp_path / "tests"
    case.write_text(CASE, encoding="utf-8")
    folder.mkdir()
    manifest = 'schema = 1\n[[mode]]\nname = "lower"\nconfiguration = "jointed"\nfrequency = "31.83 Hz"\n'
    (folder / "campaign.toml").write_text(manifest + 'damping = "1.5 %"\n', encoding="utf-8")
    assert main(["estimate", str(case), str(folder)]) == 0
    assert case.read_text(encoding="utf-8") == CASE
    assert "zeta = 1.5" in capsys.readouterr().out
    assert main(["estimate", str(case), str(folder), "--write"]) == 0
    text = case.read_text(encoding="utf-8")
    assert text.startswith(CASE.rstrip())
    # The case has 1 % in this mode: beta omega / 2.
    assert "[calibrated]" in text
    assert "zeta = 1.5" in text
    assert main(["modes", str(case), "--out", str(tmp_path / "modes")]) == 0
