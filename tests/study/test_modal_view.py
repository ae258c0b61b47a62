"""Modes and free decays of a campaign beside those of the model."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.campaign.measurement import MeasuredSensor
from correlation.data_type.linear_response import predict_linear_response
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import MeasuredMode
from correlation.data_type.response_modes import read_modes
from correlation.model import Model, Sensor
from figure.stabilisation import StabilisationDrawing
from figure.style import TitledFigure
from reduction.jointed_system import JointedSystem
from study.compare.data import compare_data
from study.compare.data_view import make_captions, show_data
from study.compare.modal_view import view_modes
from study.compare.section.modal import make_modal_sections

#: Two equal masses on three equal springs: sqrt(1) and sqrt(3) times this [Hz].
HERTZ = 200 / (2 * np.pi)


def model() -> Model:
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    force = np.zeros((2, 2), dtype=np.complex128)
    force[1, 0] = 1.0
    system = JointedSystem(
        mass=np.eye(2), damping=1e-4 * stiffness, stiffness=stiffness, joints=[], harmonic_force=force
    )
    return Model(
        system=system, sensors=tuple(Sensor(name=name, row=row) for name, row in zip("ab", np.eye(2), strict=True))
    )


def mode(name: str, frequency: float, *shape: float) -> MeasuredMode:
    return MeasuredMode(
        name=name, configuration="jointed", frequency=frequency, frequency_deviation=0.05, sensors=("a", "b"),
        shape=np.array(shape, dtype=np.complex128),
    )  # fmt: skip


def test_shapes_decide_which_mode_is_which() -> None:
    # Both are 30 % off, each towards the other.
    modes = [mode("together", 1.3 * HERTZ, 1, 1.02), mode("apart", 0.75 * np.sqrt(3) * HERTZ, 1, -0.98)]
    view = view_modes(model(), modes, compare_data(model(), modes), "Chain")
    (own,) = view.sets
    result = {own.measured[pair.measured].name: pair.model_frequency for pair in own.pairing.pairs}
    assert result == pytest.approx({"together": HERTZ, "apart": np.sqrt(3) * HERTZ})
    # cos^2 of the angle between (1, 1.02) and (1, 1), and between (1, -0.98) and (1, -1).
    assurance = {own.measured[pair.measured].name: pair.assurance for pair in own.pairing.pairs}
    expected = {"together": 2.02**2 / (2 * (1 + 1.02**2)), "apart": 1.98**2 / (2 * (1 + 0.98**2))}
    assert assurance == pytest.approx(expected)
    assert own.coordinate == pytest.approx(1, abs=1e-3)
    section, sensors = make_modal_sections(view, {"mac": b""})
    assert section.table is not None
    assert len(section.table.rows) == 2
    half = {row[1].split(" \u00b1 ")[1] for row in section.table.rows}
    assert half == {f"{1.96 * mode.frequency_deviation:.2g}" for mode in own.measured}
    assert "2 sensors" in section.text
    assert sensors.table is not None
    assert {row[1]: float(row[2]) for row in sensors.table.rows} == pytest.approx(
        dict(zip("ab", own.coordinate, strict=True)),
        abs=5e-4,  # three digits
    )


def test_modes_without_a_partner_are_named_on_either_side() -> None:
    modes = [mode("together", HERTZ, 1, 1), mode("stranger", 1.01 * HERTZ, 1, 0.98)]
    view = view_modes(model(), modes, compare_data(model(), modes), "Chain")
    section, *_ = make_modal_sections(view, {})
    assert section.table is not None
    assert [row[2] for row in section.table.rows if row[1].startswith("32.149")] == ["none"]


def test_pictures_have_the_words_of_their_figures_as_captions() -> None:
    modes = [mode("together", HERTZ, 1, 1), mode("apart", np.sqrt(3) * HERTZ, 1, -1)]
    drawn, sections = show_data(model(), modes, compare_data(model(), modes), "Chain")
    assert sections[0].pictures == {
        "modes of jointed: modal assurance criterion at 2 sensors; pairs are framed": drawn["mac"]
    }


def test_captions_that_are_alike_are_numbered() -> None:
    results = {
        "loop_1": TitledFigure(title="Chain: loops"),
        "loop_2": TitledFigure(title="Chain: loops"),
        "other": object(),
    }
    assert make_captions(results, "Chain") == {"loop_1": "loops", "loop_2": "loops (2)"}
    # Two names of users, the second of which ends like a number of the first.
    results = {name: TitledFigure(title=title) for name, title in (("a", "x"), ("b", "x"), ("c", "x (2)"), ("d", "x"))}
    assert list(make_captions(results, "Chain").values()) == ["x", "x (2)", "x (2) (2)", "x (3)"]


def test_modes_without_shapes_have_no_pairs() -> None:
    modes = [MeasuredMode(name="one", configuration="jointed", frequency=HERTZ, frequency_deviation=0.01)]
    view = view_modes(model(), modes, compare_data(model(), modes), "Chain")
    assert not view.sets
    assert not view.figures


def test_a_fit_of_accelerations_is_drawn_as_displacement_beside_what_was_measured() -> None:
    frequency = np.linspace(20.0, 70.0, 401)
    chain = model()
    chain = replace(chain, sensors=tuple(replace(sensor, quantity="acceleration") for sensor in chain.sensors))
    response = MeasuredResponse(
        name="H", test=-1, configuration="jointed", sensors=("a", "b"), frequency=frequency,
        value=np.zeros((2, 401)), units=("m/s^2 per N",) * 2, coherence=np.ones((2, 401)), level=None, repeat=1,
    )  # fmt: skip
    response = replace(response, value=predict_linear_response(chain, response))
    sensors = [MeasuredSensor(name=name, quantity="acceleration") for name in "ab"]
    data = [read_modes(response, sensors)]
    drawn = view_modes(chain, data, compare_data(chain, data), "Chain").figures["stabilisation"]
    assert isinstance(drawn, StabilisationDrawing)
    np.testing.assert_allclose(drawn.fitted, drawn.response, rtol=1e-5)
    receptance = response.value / (2 * np.pi * frequency) ** 2
    np.testing.assert_allclose(drawn.response, np.sqrt((np.abs(receptance) ** 2).mean(axis=0)), rtol=1e-12)
