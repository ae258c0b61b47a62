"""Nuisance: differences between repeats, and between a model and its refined mesh, which are not missing effects."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.feature.vector import FeatureVector
from correlation.model import LineSensor, Model, Sensor
from correlation.model_solver import Tangent
from correlation.noise.free_mode import FreeModes, Rows
from correlation.noise.latin_hypercube import draw_latin_hypercube
from correlation.noise.symmetric_root import symmetric_root
from correlation.prediction import Points, Prediction, Predictor
from hbsolve.balance import HarmonicBalance, choose_samples
from hbsolve.model_rates import MatrixParameter, ModelParameter
from reduction.joint_law.friction_contact import list_friction_contacts

Modes = Float[NDArray[np.float64], "m q"]

NOTHING = ModelParameter()
#: Coarse solution for changes by small variations of a model: instants per harmonic, least number of instants, and
#: relative residual [-].
COARSE_PER_HARMONIC, COARSE_LEAST, COARSE_TOLERANCE = 8, 48, 1e-5
#: Largest static force that a friction history leaves in a contact, over the Coulomb limit [-].
MAX_HISTORY_SHARE = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class Budget:
    """Errors of a model that are expected before the measurements.

    Parameters
    ----------
    frequency
        Standard deviation of the relative error of natural frequencies: separately of each mode, and of either
        configuration [-]. Mode shapes have corresponding errors, see `correlation.noise.free_mode`.
    damping
        ... of the relative error of the damping of each mode, in addition to a common factor [-].
    compliance
        ... of the relative error of each contact line's stiffness, normal and tangential [-].
    shares
        ... of the distribution of each line's stiffnesses and preload over its contacts, relative, at its ends [-].
    refined
        Models with more elements, stations or harmonics: their difference is one standard deviation; if parameters are
        calibrated, the difference after calibration.
    model
        Usual relative error of readings by all other causes [-]. A larger one is accepted if the measurements show it,
        see `correlation.noise.model_error`; zero for a model without model error.
    fitted
        Indices of the modes whose errors are fitted as parameters, in order of frequency. The covariance contains
        neither these errors nor an error common to all natural frequencies.
    """

    frequency: float = 2e-4
    damping: float = 0.0
    compliance: float = 0.01
    shares: float = 0.05
    refined: Sequence[Model] = ()
    model: float = 0.0
    fitted: Sequence[int] = ()


class ModelFeatures(NamedTuple):
    """Features of a model at its prediction, and their changes with the model."""

    predictor: Predictor
    features: FeatureVector
    model: Model
    prediction: Prediction

    def coarse(self) -> "ModelFeatures":
        """The same with few instants, for changes: the error is common to both models and cancels in the difference.

        On ten random systems, changes by friction histories have root mean square errors of 1 to 5 %; 16 draws
        determine a standard deviation to 18 %.
        """
        model = self.model
        instants = max(COARSE_PER_HARMONIC * (model.n_harmonic - 1), COARSE_LEAST)
        if instants >= (model.n_sample or choose_samples(model.n_harmonic)):
            return self
        coarse = replace(model, n_sample=instants)
        predictor = replace(self.predictor, tolerance=COARSE_TOLERANCE)
        value = predictor.vary(coarse, self.prediction)
        return self._replace(predictor=predictor, model=coarse, prediction=replace(self.prediction, value=value))

    def changes(self, model: Model) -> Float[NDArray[np.float64], " m"]:
        """Features of another model less those of this one, shape (m,); NaN where a state is missing."""
        value = self.predictor.vary(model, self.prediction)
        return np.asarray(self.features.of_values(value) - self.features.of_values(self.prediction.value))

    def slopes(self, tangents: Sequence[Tangent]) -> Modes:
        """Derivatives of the features, shape (m, q); zero where a state is missing."""
        if not tangents:
            return np.zeros((len(self.features.row), 0))
        rates = self.predictor.derivatives(self.model, self.prediction, tangents)
        slopes = self.features.slopes(self.prediction.value, rates)
        return np.where(np.isfinite(slopes), slopes, 0.0)


#: Number of causes of jitter before the preloads, one mode each (frequency and force of each configuration), and
#: indices of the forces among them.
N_COMMON, FORCES = 4, (2, 3)


class NuisanceModes(NamedTuple):
    """Modes to first order."""

    jitter: list[Modes]
    """Differences between repeats, for 100 %: frequency, then force of each configuration, then the preload groups."""
    budget: Modes
    """Errors of discretisation, at one standard deviation, shape (m, b)."""


def make_nuisance_modes(nominal: ModelFeatures, budget: Budget, refined: Sequence[Model]) -> NuisanceModes:
    """Differences between repeats and errors of discretisation; `refined` has the parameters of the model."""
    groups = nominal.model.preload_groups
    errors = make_error_tangents(
        nominal.model, nominal.prediction, budget, find_highest_frequency(nominal.features.points)
    )
    common = [*make_frequency_shifts(nominal.model, by_exciter=True), *_make_force_excesses(nominal.model)]
    jitter = [*common, *(_make_preload_tangent(nominal.model, group) for group in groups)]
    # Each state is linearised once for all tangents.
    modes, slopes = np.split(nominal.slopes([*jitter, *errors.tangents]), [len(jitter)], axis=1)
    changes = errors.size * slopes
    later = [*changes[:, errors.n_shared :].T, *(nominal.changes(finer) for finer in refined)]
    by_level = [split_by_level(nominal.features, np.where(np.isfinite(change), change, 0.0)) for change in later]
    return NuisanceModes(
        jitter=[*(modes[:, [number]] for number in range(N_COMMON)), *([modes[:, N_COMMON:]] if groups else [])],
        budget=np.column_stack([changes[:, : errors.n_shared], *by_level]),
    )


def _make_force_excesses(model: Model) -> list[Tangent]:
    """A larger force in the jointed and in the free test; zero for a base excitation, whose motion is measured."""
    force = None if model.base_acceleration is not None else model.system.dynamic
    rate = ModelParameter(harmonic_force=force)
    return [
        Tangent(jointed=rate, free=ModelParameter(), gain={}),
        Tangent(jointed=ModelParameter(), free=rate, gain={}),
    ]


class ErrorTangents(NamedTuple):
    """Numerical errors to first order, and their standard deviations."""

    tangents: list[Tangent]
    size: Float[NDArray[np.float64], " n"]
    n_shared: int
    """Number of errors common to all levels, which come first; the others are independent at each level."""


def make_error_tangents(model: Model, prediction: Prediction, budget: Budget, highest: float) -> ErrorTangents:
    """Tangents of the discretisation errors of a model: of its natural frequencies and shapes, then of its contacts.

    Parameters
    ----------
    model, prediction
        Model, and its states.
    budget
        Standard deviations of its errors.
    highest
        Highest frequency of the readings, including harmonics [Hz]; modes far above it are negligible.
    """
    structure, damped = list[Tangent](), list[Tangent]()
    modes = FreeModes.below(model, highest) if budget.frequency or budget.damping else None
    if modes is not None and budget.frequency:
        motions = np.array([state.coefficients[1] for state in prediction.states.values()])
        structure += [] if budget.fitted else make_frequency_shifts(model, by_exciter=False)
        structure += [mode for number, mode in enumerate(modes.frequency_errors()) if number not in budget.fitted]
        structure += modes.shape_errors(motions, _list_rows_of_readings(model))
    if modes is not None and budget.damping:
        damped += modes.damping_errors(model.system)
    contacts = make_contact_errors(model, budget)
    return ErrorTangents(
        [*structure, *damped, *contacts.tangents],
        np.concatenate([np.repeat([budget.frequency, budget.damping], [len(structure), len(damped)]), contacts.size]),
        len(structure) + len(damped) + contacts.n_shared,
    )


def _list_rows_of_readings(model: Model) -> list[Rows]:
    """Rows of the measured motions, of the measured forces of stuck lines, and of the excitation."""
    motions = [item.row for item in model.sensors if isinstance(item, Sensor)]
    lines = [_make_stuck_force_row(model, item) for item in model.sensors if isinstance(item, LineSensor)]
    forces = [part for force in model.system.dynamic for part in (force.real, force.imag) if part.any()]
    return [np.array(rows).reshape(-1, model.system.n_dof) for rows in (motions, lines, forces)]


def _make_stuck_force_row(model: Model, sensor: LineSensor) -> Float[NDArray[np.float64], " r"]:
    """Row of the force that the sensor of a line reads for stuck and closed contacts [N/m]."""
    contacts = [model.contact(name) for name in model.lines[sensor.line]]
    if sensor.component == "tangential":
        rows = [contact.tangential_stiffness * contact.directions[0] for contact in contacts]
    else:
        rows = [contact.normal_stiffness * contact.directions[-1] for contact in contacts]
    return np.asarray(np.sum(rows, axis=0))


def make_contact_errors(model: Model, budget: Budget) -> ErrorTangents:
    """Tangents of the discretisation errors of contact lines."""
    softer = [_make_stiffness_tangent(model, line, name) for line in model.lines for name in ("tangential", "normal")]
    patterns = _share_patterns(model)
    size = np.repeat([budget.compliance, budget.shares], [len(softer), len(patterns)])
    return ErrorTangents([*softer, *patterns], size, len(softer))


def find_highest_frequency(points: Points) -> float:
    """Highest frequency of the readings, including harmonics [Hz]."""
    return float((points.frequency * np.maximum(points.harmonic, 1)).max())


def split_by_level(features: FeatureVector, change: Float[NDArray[np.float64], " m"]) -> Modes:
    """A change as one mode per level, since the slipping contacts differ."""
    level = features.points.level[features.row]
    return np.array([np.where(level == item, change, 0.0) for item in np.unique(level)]).T


def make_history_modes(
    reference: ModelFeatures,
    n_draw: int,
    seed: int,
    preload_covariance: Float[NDArray[np.float64], "q q"] | None = None,
    preload_modes: Modes | None = None,
) -> Modes:
    """Modes of friction histories, at one standard deviation, shape (m, h).

    A sticking contact sustains any static force within the Coulomb cone. Each draw starts all sliders from a force of
    -90 to 90 % of the limit at rest. Each level of each repeat has another history, so that the draws are modes of each
    level separately. The difference between the mean of the draws and the prediction without a history is an additional
    mode. The draws form a Latin hypercube: a few independent ones would leave directions without any change.

    With different preloads a contact may slip in one draw and stick in another: with `preload_covariance` of the
    preload groups, shape (q, q), preloads are drawn as well. Their first-order change is subtracted, since jitter
    contains it: `preload_modes`, shape (m, q), computed by default.
    """
    predictor, features, model, prediction = reference
    points = features.points
    contacts = list_friction_contacts(model.system.joints)
    jointed = np.flatnonzero(~points.free)
    if not contacts or not len(jointed):
        return np.zeros((len(features.row), 0))
    kept = points.where(~points.free)
    nominal = features.of_values(prediction.value)
    amounts = np.zeros((n_draw, len(model.preload_groups)))
    if preload_covariance is not None:
        amounts = draw_normal(preload_covariance, n_draw, seed)
    if preload_covariance is not None and preload_modes is None:
        preload_modes = reference.slopes([_make_preload_tangent(model, group) for group in model.preload_groups])
    changes, followed = [], replace(predictor, points=kept)
    histories = draw_latin_hypercube(n_draw, count_contact_sliders(model), seed)
    for history, amount in zip(histories, amounts, strict=True):
        moved = model
        for group, by in zip(model.preload_groups, amount, strict=True):
            for name in group if by else ():
                moved = moved.with_preload_ratio(name, 1 + by)
        value = np.array(prediction.value)
        value[jointed] = replace(followed, slider=make_slider_start(moved, history)).vary(moved, prediction)
        changes.append(features.of_values(value) - nominal - (0.0 if preload_modes is None else preload_modes @ amount))
    apart = np.nan_to_num(np.array(changes))
    mean = apart.mean(axis=0)
    modes = []
    for level in np.unique(points.level):
        at = (points.level == level)[features.row]
        modes += [np.where(at, change - mean, 0.0) / np.sqrt(max(n_draw - 1, 1)) for change in apart]
        modes.append(np.where(at, mean, 0.0))
    return np.array(modes).T


def draw_normal(covariance: Float[NDArray[np.float64], "q q"], count: int, seed: int) -> Modes:
    """Normal random vectors with mean zero and a given covariance, shape (count, q)."""
    drawn = np.random.default_rng([seed, 1]).standard_normal((count, len(covariance)))
    return np.asarray(drawn @ symmetric_root(covariance))


def count_contact_sliders(model: Model) -> int:
    """Number of sliders of all friction contacts [-]."""
    return sum(contact.n_slider for contact in list_friction_contacts(model.system.joints))


def make_slider_start(
    model: Model, history: Float[NDArray[np.float64], " sliders"]
) -> Callable[[HarmonicBalance], NDArray[np.float64]]:
    """Slider positions after a history: static forces within `MAX_HISTORY_SHARE` of the limits at rest.

    Parameters
    ----------
    model
        Model with friction contacts.
    history
        A point of the unit cube with one coordinate for each of `count_contact_sliders`. 0 and 1 are
        `MAX_HISTORY_SHARE` of the limit, in either direction. For two tangents with a common limit, the coordinates
        determine radius and angle in its circle.
    """

    def slider(balance: HarmonicBalance) -> NDArray[np.float64]:
        start, done = np.zeros(balance.n_slider), 0
        numbers = {joint.name: number for number, joint in enumerate(model.system.joints)}
        for contact in list_friction_contacts(model.system.joints):
            number = numbers[contact.name]
            first, last = balance.table.slider[number : number + 2]
            share = history[done : done + last - first]
            done += last - first
            if contact.coupled:
                # The root gives a uniform density over the circle.
                turn = 2 * np.pi * share[1]
                force = np.sqrt(share[0]) * np.array([np.cos(turn), np.sin(turn)])
            else:
                force = 2 * share - 1
            start[first:last] = MAX_HISTORY_SHARE * force * contact.limit_at_rest / contact.tangential_stiffness
        return start

    return slider


def make_frequency_shifts(model: Model, *, by_exciter: bool) -> list[Tangent]:
    """A relative shift of Omega at fixed forces, separately for each configuration: (1 + 2 e) M and (1 + e) C.

    A shift by the exciter changes the frequency of readings as well; an error of natural frequencies does not.
    """
    shift = ModelParameter(matrices=MatrixParameter(mass=2 * model.system.mass, damping=model.system.damping))
    read = [{name: float(by_exciter)} for name in ("jointed", "free")]
    return [
        Tangent(jointed=shift, free=NOTHING, gain={}, frequency_shift=read[0]),
        Tangent(jointed=NOTHING, free=shift, gain={}, frequency_shift=read[1]),
    ]


def _make_preload_tangent(model: Model, group: tuple[str, ...]) -> Tangent:
    """A common factor on a group of preloads."""
    static = np.zeros(model.system.n_dof)
    rates: dict[tuple[str, str], float] = {}
    for name in group:
        load, slopes = model.preload_slope(name)
        static += load
        rates |= {(contact, "preload"): slope for contact, slope in slopes.items()}
    return Tangent(jointed=ModelParameter(static_load=static, joints=rates), free=NOTHING, gain={})


def _share_patterns(model: Model) -> list[Tangent]:
    """Shares of all lines moved from the middle contacts to the ends, by 100 % of those at the ends.

    Another integration rule along the line has this effect. A tilt is a misalignment, hence a missing effect.
    """
    result = []
    for field in ("preload", "tangential_stiffness", "normal_stiffness"):
        static, rates = np.zeros(model.system.n_dof), {}
        for names in model.lines.values():
            contacts = [model.contact(name) for name in names]
            values = np.array([getattr(contact, field) for contact in contacts])
            for contact, rate in zip(contacts, values * compute_parabolic_share(values), strict=True):
                rates[contact.name, field] = float(rate)
                if field == "preload":
                    static += rate * contact.normal
        if any(rates.values()):
            result.append(Tangent(jointed=ModelParameter(static_load=static, joints=rates), free=NOTHING, gain={}))
    return result


def compute_parabolic_share(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Parabola along a line that preserves its sum and first moment, 1 at its larger end; zero for one or two contacts.

    Also zero if weights are zero or have different signs.
    """
    if len(weights) < 3 or not ((weights > 0).all() or (weights < 0).all()):
        return np.zeros(len(weights))
    along = np.linspace(-1, 1, len(weights))
    root = np.sqrt(np.abs(weights))
    parabola = np.linalg.qr(root[:, None] * along[:, None] ** np.arange(3))[0][:, -1] / root
    return np.asarray(parabola / np.abs(parabola[[0, -1]]).max())


def _make_stiffness_tangent(model: Model, line: str, component: str) -> Tangent:
    field = f"{component}_stiffness"
    rates = {(name, field): float(getattr(model.contact(name), field)) for name in model.lines[line]}
    return Tangent(jointed=ModelParameter(joints=rates), free=NOTHING, gain={})
