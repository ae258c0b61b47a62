"""Load cells of a coarse rig as sensors: what they read at rest and in motion, and how far eqs 1 and 2 are true."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from casefile.errors import CaseError
from correlation.model import LoadCell, Model
from correlation.model_solver import ModelSolver
from correlation.prediction import Points, Predictor
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.load_cell import compute_decoupler_contact
from study.case.setup import ReadCase
from study.kind.rig.forces import RigForces, compute_rig_forces
from study.kind.rig.structure import LOAD_CELLS, PreloadedRig

ReadRig = Callable[[str], ReadCase]
CELLS = "".join(f'[[sensor]]\nname = "push {name}"\ncell = "{name}"\n' for name in LOAD_CELLS)
MORE = CELLS + "[harmonics]\nhighest = 3\nsamples = 64\n"
#: Round-off of static solutions, relative: stiffness of 1e9 N/m beside springs of 1e6 N/m.
ROUND_OFF = 1e-6


@dataclass(frozen=True)
class Read:
    model: Model
    preloaded: PreloadedRig


@pytest.fixture(scope="module")
def rig(read_rig: ReadRig) -> Read:
    result = read_rig(MORE)
    return Read(result.model, result.structure.details)


def state_of(rig: Read, frequency: float) -> tuple[np.ndarray, RigForces]:
    """Readings of the cells, mean and first harmonic, and the forces of the rig, at a level of 2 N."""
    solver = ModelSolver.from_model(rig.model, free=False, slider=None)
    state = solver.solve(2.0, frequency, solver.slider, ())
    assert state is not None
    names = np.array([f"push {name}" for name in LOAD_CELLS])
    readings = [solver.read(state, names, np.full(4, harmonic)) for harmonic in (0, 1)]
    return np.array(readings), compute_rig_forces(rig.preloaded, solver.balance.at_level(2.0), state)


@pytest.mark.parametrize("frequency", [0.5, 120.0])
def test_cells_read_the_reactions_of_the_arms(rig: Read, frequency: float) -> None:
    readings, forces = state_of(rig, frequency)
    for number, (side, cell) in enumerate(LOAD_CELLS.values()):
        pushed = forces.cells[f"decoupler_{side}"][("cell_upper", "cell_lower").index(cell)]
        spectrum = np.fft.rfft(pushed) / len(pushed)
        # The mass beside the fixed end, which the row leaves out, is a thousandth of the arm's and hardly moves.
        assert readings[0, number].real == pytest.approx(spectrum[0].real, rel=1e-4)
        assert abs(readings[1, number] - 2 * spectrum[1]) < 1e-3 * abs(2 * spectrum[1])


def test_a_prediction_of_a_campaign_reads_them_too(rig: Read) -> None:
    names = np.array([f"push {name}" for name in LOAD_CELLS])
    points = Points(
        free=np.zeros(4, dtype=bool), level=np.full(4, 2.0), frequency=np.full(4, 120.0), sensor=names,
        harmonic=np.zeros(4, dtype=int),
    )  # fmt: skip
    readings, _ = state_of(rig, 120.0)
    # Residuals of Newton's method.
    np.testing.assert_allclose(Predictor(points=points).predict(rig.model).value, readings[0], rtol=1e-6)


def test_at_rest_cells_and_blade_carry_the_dead_weights(rig: Read) -> None:
    rest, line = rig.preloaded.static_state, {}
    for name, members in rig.preloaded.joined.lines.items():
        own = [item for item in rest.contacts if item.name in members]
        rows = [rest.contacts.index(item) for item in own]
        theta = rig.preloaded.model.rig.damper.cone_half_angle
        # T of a contact is reckoned along its tangent, away from the damper's middle on both lines.
        line[name] = sum(rest.normal[row] for row in rows) * np.cos(theta)
    cells = {name: rig.model.load_cells[name].at_rest for name in LOAD_CELLS}
    # A rig that is symmetric about y = 0.
    assert cells["R1"] == pytest.approx(cells["R3"], rel=ROUND_OFF)
    assert cells["R2"] == pytest.approx(cells["R4"], rel=ROUND_OFF)
    # Upwards: the arms carry what the blade does not, 55 N in all; contact and arms agree but for T and for bending.
    up = (cells["R3"] - cells["R4"]) * np.sin(np.pi / 4)
    assert up == pytest.approx(55 / 2, rel=0.03)
    assert line["right_decoupler"] == pytest.approx(55 / 2, rel=0.1)


def test_equations_1_and_2_hold_to_a_few_percent(rig: Read) -> None:
    readings, forces = state_of(rig, 120.0)
    rig_, error = rig.preloaded.model.rig, {}
    theta, alpha = rig_.damper.cone_half_angle, rig_.decoupler.arm_angle
    for side, upper, lower in (("left", 0, 1), ("right", 2, 3)):
        told = compute_decoupler_contact(readings[:, upper], readings[:, lower], theta, alpha)
        true = forces.lines[f"{side}_decoupler"].force
        size = max(np.abs(item).max() for item in true)
        for name, own, other in (("T", told.tangential, true.tangential), ("N", told.normal, true.normal)):
            spectrum = np.fft.rfft(other) / len(other)
            error[side, name, "static"] = abs(own[0].real - spectrum[0].real) / size
            error[side, name, "dynamic"] = abs(own[1] - 2 * spectrum[1]) / size
    # Arms that bend and inertia: `stickslip solve` reports up to 3 % of this mesh.
    assert max(error.values()) < 0.04
    assert max(error.values()) > 1e-3


def test_a_stiffer_structure_under_the_same_weights_pushes_its_cells_as_much(rig: Read) -> None:
    (stiffer,) = (item for item in list_calibration_parameters(rig.model) if item.name == "E")
    changed = replace(rig, model=stiffer.apply(rig.model, [1.02]))
    for one, other in zip(rig.model.sensors, changed.model.sensors, strict=True):
        assert isinstance(one, LoadCell)
        assert isinstance(other, LoadCell)
        np.testing.assert_allclose(other.row, 1.02 * one.row)
    before, after = (state_of(entry, 0.5)[0] for entry in (rig, changed))
    # Equilibrium decides, up to what the arms' bending takes part in: 2 % of 2 %.
    np.testing.assert_allclose(after[0], before[0], rtol=5e-3, atol=5e-3 * np.abs(before[0]).max())


def test_a_cell_that_the_rig_has_not_is_refused(read_rig: ReadRig) -> None:
    with pytest.raises(CaseError, match=r"R5.*R1, R2, R3, R4"):
        read_rig(MORE.replace('cell = "R4"', 'cell = "R5"'))


def test_rest_is_reckoned_in(rig: Read) -> None:
    balance = HarmonicBalance(system=rig.model.system, n_harmonic=2, n_sample=64, level=1e-9)
    slider = np.concatenate(rig.preloaded.static_state.slider.reshape(-1, 1))
    state = steady_state(balance, 2 * np.pi * 150.0, slider=slider)
    for cell in rig.model.load_cells.values():
        moved = float(cell.row @ state.coefficients[0].real)
        assert abs(moved) < 1e-3 * abs(cell.at_rest)
