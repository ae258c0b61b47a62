r"""Prediction of force-displacement loops by a model.

An imposed displacement is modelled by a grip: a spring of stiffness g, far stiffer than the structure, whose other end
moves by :math:`u = u_0 + A \cos \Omega t`. Its force :math:`g (u - p^T x)` at the place p is the measured force.
"""

import numpy as np
from numpy.typing import NDArray

from correlation.data_type.measured_loop import FEATURES, ForceLoop, Numbers, Signal
from correlation.errors import CampaignError
from correlation.model import LineSensor, Model, Sensor
from correlation.model_solver import ModelSolver
from correlation.sensor_placement import offer_places
from correlation.signal.loop import Plateau, analyse_loop
from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.steady_state import steady_state
from reduction.stuck import stick_at_rest

#: Stiffness of a grip over that of the structure at its place; its inverse is the relative error of the displacement.
GRIP = 1e5
#: Number of instants in a period of a predicted loop.
INSTANTS = 512


@on_one_blas_thread
def predict_loop(model: Model, loop: ForceLoop) -> Numbers:
    """Features of the loops of a model, shape (m,); NaN without a steady state.

    Raises
    ------
    CampaignError
        The model lacks the place, the line or the sensor.
    """
    if loop.line is not None:
        curve = predict_driven_loop(model, loop)
        rows = [*_compute_loop_features(curve), np.nan if curve is None else float(np.ptp(curve[0])) / 2]
        return np.array(rows * len(loop.loops.plateaus))
    return np.concatenate(
        [_compute_loop_features(predict_imposed_loop(model, loop, plateau)) for plateau in loop.loops.plateaus]
    )


def predict_curve(model: Model, loop: ForceLoop, plateau: Plateau) -> tuple[Signal, Signal] | None:
    """Displacement and force of one predicted period, shape (512,) each [m, N]; None without a steady state.

    Raises
    ------
    CampaignError
        The model lacks the place, the line or the sensor.
    """
    return predict_imposed_loop(model, loop, plateau) if loop.line is None else predict_driven_loop(model, loop)


def predict_imposed_loop(model: Model, loop: ForceLoop, plateau: Plateau) -> tuple[Signal, Signal] | None:
    """Displacement and force of one predicted period, shape (512,) each [m, N]; None without a steady state.

    Raises
    ------
    CampaignError
        The model has no such place.
    """
    if loop.place is None or loop.place not in model.places:
        raise CampaignError(
            f'loop "{loop.name}": the model has no place "{loop.place}"; {offer_places(model, str(loop.place))}'
        )
    row = model.places[loop.place]
    system = model.system
    stiff = stick_at_rest(system.stiffness, system.joints)
    grip = GRIP * float(row @ stiff @ row) / float(row @ row) ** 2
    omega = 2 * np.pi * loop.frequency
    force = np.zeros((2, system.n_dof), dtype=np.complex128)
    force[1] = grip * plateau.amplitude[0] * row
    gripped = model.with_system(
        stiffness=system.stiffness + grip * np.outer(row, row),
        static_load=system.static + grip * plateau.displacement_offset[0] * row,
        harmonic_force=force,
    ).system
    balance = HarmonicBalance(system=gripped, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    try:
        state = steady_state(balance, omega)
    except NoSteadyState:
        return None
    x = _signal(state.coefficients @ row)
    imposed = np.zeros(len(state.coefficients), dtype=np.complex128)
    imposed[:2] = plateau.displacement_offset[0], plateau.amplitude[0]
    return x, grip * (_signal(imposed) - x)


def predict_driven_loop(model: Model, loop: ForceLoop) -> tuple[Signal, Signal] | None:
    """Displacement and tangential force of a contact line in one predicted period of the structure under its loads.

    Returns
    -------
    Shape (512,) each [m, N]; None without a steady state.

    Raises
    ------
    CampaignError
        The model has no such line, or no such motion sensor.
    """
    if loop.line not in model.lines:
        raise CampaignError(
            f'loop "{loop.name}": the model has no line "{loop.line}"; its lines: {", ".join(model.lines) or "none"}'
        )
    force = LineSensor(name=f"{loop.name}, force", line=str(loop.line), component="tangential")
    motion = next((item for item in model.sensors if item.name == loop.sensor), None)
    if not isinstance(motion, Sensor):
        raise CampaignError(
            f'loop "{loop.name}": the model has no sensor of motion "{loop.sensor}": add it to the case'
        )
    solver = ModelSolver.from_model(Model(**{**vars(model), "sensors": (motion, force)}), free=False, slider=None)
    assert loop.level is not None
    state = solver.solve(loop.level, loop.frequency, solver.slider, ())
    if state is None:
        return None
    harmonics = np.arange(model.n_harmonic)
    x = solver.read(state, np.full(len(harmonics), motion.name), harmonics)
    f = solver.read(state, np.full(len(harmonics), force.name), harmonics)
    members = model.lines[force.line]
    tangent = np.sum([joint.directions[0] for joint in model.system.joints if joint.name in members], axis=0)
    # The axis of the sensor may be opposite to the tangent: the force of a loop resists the measured motion.
    turn = -1.0 if float(motion.gain * (motion.row @ tangent)) < 0 else 1.0
    return _signal(x), turn * _signal(f)


def _signal(coefficients: NDArray[np.complex128]) -> Signal:
    """One period of x(t) = Re sum X_k e^{i k Omega t}, shape (512,)."""
    phase = 2 * np.pi * np.arange(INSTANTS)[:, None] / INSTANTS * np.arange(len(coefficients))
    return np.asarray((np.exp(1j * phase) @ coefficients).real)


def _compute_loop_features(curve: tuple[Signal, Signal] | None) -> list[float]:
    """Features of one predicted period, by the same analysis as for measured loops."""
    if curve is None:
        return [np.nan] * len(FEATURES)
    x, f = (np.tile(signal, 3) for signal in curve)
    result = analyse_loop(x, f)
    return [float(getattr(result, name)[0]) for name, _, _ in FEATURES]
