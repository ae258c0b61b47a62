"""The structure as the page draws it."""

import numpy as np
import pytest

from correlation.prediction import Points, Predictor
from study.beam.model import beam_model
from study.bench.view.operation import list_operations
from study.bench.view.structure import show_structure
from study.case.setup import read_case
from study.shipped_cases import SOLVE


def test_a_beam_is_a_chain_whose_first_mode_bends_it_at_the_frequency_of_the_closed_form() -> None:
    shown = show_structure(beam_model(24, n_harmonic=2))
    assert [body["is_chain"] for body in shown["bodies"]] == [True]
    points = np.transpose(shown["bodies"][0]["points"])
    assert (np.diff(points[:, 0]) > 0).all()
    # Clamped and free: (1.8751 / L)^2 sqrt(E I / (rho A)) / 2 pi of 300 x 20 x 10 mm of steel, 210 GPa and 7800 kg/m^3;
    # the case's own steel may differ by a per cent.
    closed = 1.8751**2 / 0.3**2 * np.sqrt(210e9 * 0.01**2 / 12 / 7800) / (2 * np.pi)
    mode = shown["modes"][0]
    assert mode["frequency"] == pytest.approx(closed, rel=0.02)
    ((shape,), *marks) = mode["shape"]
    shape = np.array(shape[2])
    # The sensor at the tip moves with it.
    names = [mark["name"] for mark in shown["marks"]]
    assert marks[names.index("tip")][0][2][0] == pytest.approx(shape[-1])
    # It grows from the clamp to the tip, where it is as large as the page shows it.
    assert (np.diff(np.abs(shape)) > 0).all()
    assert abs(shape[-1]) == pytest.approx(0.12 * np.ptp(points[:, 0]), rel=1e-3)


def test_sensors_lines_and_load_stand_where_their_rows_act() -> None:
    model = beam_model(24, n_harmonic=2)
    marks = {(mark["kind"], mark["name"]): mark["points"] for mark in show_structure(model)["marks"]}
    tip = max(dof.coordinates[0] for dof in model.dofs if dof.coordinates is not None)
    assert marks["sensor", "tip"][0][0] == pytest.approx(tip)
    assert len(marks["contact line", "left"][0]) == len(model.lines["left"])
    assert marks["load", "load"] == marks["sensor", "excitation"]


def test_matrices_without_geometry_are_a_list_of_rows() -> None:
    shown = show_structure(read_case(SOLVE).setup.model)
    assert shown["bodies"] == []
    assert shown["rows"]


def test_a_contact_line_sticks_under_a_small_force_and_slips_under_a_large_one() -> None:
    model = beam_model(24, n_harmonic=4)
    frequency = np.array([465.0, 472.0, 479.0])
    small, large = 1e-6, 10.0
    points = Points(
        free=np.zeros(6, dtype=bool), level=np.repeat([small, large], 3), frequency=np.tile(frequency, 2),
        sensor=np.array(["tip"] * 6), harmonic=np.ones(6, dtype=np.int64),
    )  # fmt: skip
    prediction = Predictor(points=points).predict(model)
    stuck, slipping = list_operations(model, prediction, "N")
    tip = np.abs(prediction.value).reshape(2, 3).argmax(axis=1)
    assert [stuck.label, slipping.label] == [
        f"{level:g} N, {frequency[at]:g} Hz" for level, at in zip((small, large), tip, strict=True)
    ]
    assert {rows.shape for rows in stuck.states.values()} == {(3, 24)}
    assert not any(rows.any() for rows in stuck.states.values())
    assert any((rows == 1).any() for rows in slipping.states.values())
    shown = show_structure(model, operations=[stuck])
    # A damped motion has a phase, so that both parts are drawn.
    ((real, imaginary), *_) = shown["operations"][0]["shape"]
    length = np.hypot(np.linalg.norm(real, axis=0), np.linalg.norm(imaginary, axis=0)).max()
    assert length == pytest.approx(0.12 * np.ptp(shown["bodies"][0]["points"][0]), rel=1e-3)
