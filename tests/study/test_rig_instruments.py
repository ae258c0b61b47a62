"""What measures a coarse rig and changes it: accelerometer, stinger, and lasers that lean."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from casefile.errors import CaseError
from correlation.model import LineSensor, Sensor
from correlation.model_solver import ModelSolver
from fe.dense_modes import compute_dense_modes
from study.case.setup import ReadCase
from study.kind.rig.structure import PreloadedRig

ReadRig = Callable[[str], ReadCase]
MORE = "[harmonics]\nhighest = 3\nsamples = 64\n"


def blade_frequency(read: ReadCase) -> float:
    preloaded: PreloadedRig = read.structure.details
    return float(preloaded.reduction.assembly.bodies["blade"].modes(1).frequency[0])


@pytest.mark.parametrize(
    ("tables", "place", "mass", "stiffness"),
    [
        ('[structure.accelerometer]\nmass = "0.5 g"\n', "tip", 0.5e-3, 0.0),
        ('[structure.stinger]\nstiffness = "2 N/um"\n', "excitation", 0.0, 2e6),
    ],
)
def test_small_changes_shift_the_blade_as_rayleighs_quotient_says(
    read_rig: ReadRig, tables: str, place: str, mass: float, stiffness: float
) -> None:
    plain = read_rig("")
    own = plain.structure.details.reduction.assembly.bodies["blade"]
    lowest = compute_dense_modes(own.mass, own.stiffness)
    shape = np.zeros(plain.model.system.n_dof)
    shape[plain.structure.details.reduction.assembly.columns("blade")] = lowest.mode_shapes[:, 0]
    moved, omega2 = float(plain.model.places[place] @ shape), float(lowest.lambda_[0])
    expected = np.sqrt((omega2 + stiffness * moved**2) / (1 + mass * moved**2) / omega2)
    result = blade_frequency(read_rig(tables)) / blade_frequency(plain)
    assert abs(expected - 1) > 1e-3
    # Rayleigh's quotient of the unchanged shape errs by the square of the change.
    assert result - 1 == pytest.approx(expected - 1, rel=0.05)


def test_heads_that_lean_read_cosine_along_and_sine_across(read_rig: ReadRig) -> None:
    straight = read_rig(MORE).model
    leaning = read_rig('[structure.laser]\ndamper = "13 deg"\nblade = "-5 deg"\n' + MORE).model
    name = "damper right against blade"
    before, after = (
        next(item for item in model.sensors if item.name == name and isinstance(item, Sensor))
        for model in (straight, leaning)
    )
    damper, blade = before.heads["damper"], before.heads["blade"]
    np.testing.assert_allclose(damper.along + blade.along, before.row)
    directions = {dof.direction for dof, value in zip(straight.dofs, damper.across, strict=True) if value}
    assert directions == {"z"}
    a, b = np.deg2rad([13.0, -5.0])
    expected = np.cos(a) * damper.along + np.sin(a) * damper.across
    expected += np.cos(b) * blade.along + np.sin(b) * blade.across
    np.testing.assert_allclose(after.row, expected, atol=1e-15)
    # Turned back, it reads what it did.
    np.testing.assert_allclose(after.leaning("damper", -a).leaning("blade", -b).row, before.row, atol=1e-15)


def stiffness_as_read(read_rig: ReadRig, tables: str) -> float:
    """Slope of the stuck loop of the right blade line, T over what the laser reads [N/m]."""
    model = read_rig(tables + MORE).model
    force = LineSensor(name="T", line="right_blade", component="tangential")
    solver = ModelSolver.from_model(replace(model, sensors=(*model.sensors, force)), free=False, slider=None)
    state = solver.solve(0.01, 250.0, solver.slider, ())
    assert state is not None
    moved, pushed = solver.read(state, np.array(["damper right against blade", "T"]), np.ones(2, dtype=int))
    return float(abs(pushed / moved))


def test_a_head_that_leans_biases_the_stiffness_that_a_loop_shows(read_rig: ReadRig) -> None:
    straight = stiffness_as_read(read_rig, "")
    # The point beside the line moves a little less or more than the line: within a third of its 4.6 N/um.
    assert straight == pytest.approx(4.6e6, rel=0.35)
    up, down = (stiffness_as_read(read_rig, f'[structure.laser]\nblade = "{angle} deg"\n') for angle in (13, -13))
    # The head at the blade reads a share of its motion along the span, of one sign or the other.
    assert abs(up / straight - 1) > 0.03
    assert abs(up / down - 1) > 0.06


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ('[structure.laser]\ndamper = "85 deg"\n', "80 deg"),
        ('[structure.accelerometer]\nmass = "-1 g"\n', "mass"),
        ('[structure.stinger]\nstiffness = "-1 N/m"\n', "stiffness"),
        ('[structure.root]\nstiffness = "0 N/m"\n', "stiffness"),
        ('[structure.blade_material]\ndensity = "-7800 kg/m^3"\n', "density"),
    ],
)
def test_a_mistake_names_its_key(read_rig: ReadRig, tables: str, said: str) -> None:
    with pytest.raises(CaseError, match=said):
        read_rig(tables)
