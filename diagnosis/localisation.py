r"""Localisation of a missing force, and its kind, without a catalogue of effects.

A missing force f at a place with row p of the calibrated model changes the response as an unknown stiffness would,

.. math:: f = -\kappa(a)\, u, \qquad u = p \cdot q

with a complex kappa for each level: positive real for a spring, negative real for a mass, imaginary for damping. Within
a level the force follows the amplitude with the exponent p. If third harmonics were measured, a force at three times
the frequency is added,

.. math:: f_3 = \lambda\, (|u| / \max |u|)^p\, (u / |u|)^3 ,

as any nonlinear force of the displacement has. For each place the whitened residual is fitted with kappa and lambda at
all levels, the calibration parameters projected out. The place with the largest gain locates the force; the growth of
kappa and lambda with amplitude gives the exponent, their phase the kind of force.

Phases of the missing force relative to the displacement: 180 deg spring, 0 deg inertia, -90 deg damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.model import Model
from correlation.model_solver import Tangent
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.place import LINEAR, PlaceUnits, choose_units
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Matrix
from diagnosis.model_error_share import ProjectedCovariance
from hbsolve.model_rates import MatrixParameter, ModelParameter

NOTHING = ModelParameter()
#: Exponents of the amplitude that are fitted at each place [-].
EXPONENTS = (0.0, 1.0, 2.0, 3.0, 4.0)
#: Least standard deviation of an exponent interpolated between these values [-].
MIN_EXPONENT_DEVIATION = 0.3
#: Largest difference of phases of one kind of force: half of that between a spring and a dashpot [deg].
SAME_KIND = 45.0
#: Least size of a force that is used for the phase [standard deviations].
CLEAR_FORCE = 3.0
#: Meaning of a phase.
PHASES = "180 spring, 0 mass, -90 damping"


@dataclass(frozen=True, kw_only=True, eq=False)
class UnknownForcePlace:
    """A place at which an unknown force explains the residual.

    Parameters
    ----------
    name
        Name of the place in the model.
    gain
        Fall of chi^2 [-].
    n_number
        Number of fitted parameters: real and imaginary parts of kappa, and of lambda, per level [-].
    level, amplitude
        Levels, and the largest amplitude of the place at each level, shape (l,) [N; m or rad].
    stiffness
        kappa, shape (l,) [N/m].
    deviation
        Standard deviation of real and imaginary part of kappa, shape (l,) [N/m].
    third
        lambda, shape (l,) [N]; zero if no third harmonics were measured.
    exponent
        Exponent p of f ~ a^p [-]: 1 for a linear force, 2 for air, 3 for a cubic spring.
    exponent_deviation
        Standard deviation of the exponent [-].
    phase
        Phase of the force relative to the displacement [deg]; None if it varies with the level or depends on the share
        of model error, or if no sensor has a phase.
    configuration
        Configuration in which the force is missing: "jointed" or "free".
    units
        Units at the place; for an angle, forces are moments.
    """

    name: str
    gain: float
    n_number: int
    level: Float[NDArray[np.float64], " l"]
    amplitude: Float[NDArray[np.float64], " l"]
    stiffness: Complex[NDArray[np.complex128], " l"]
    deviation: Float[NDArray[np.float64], " l"]
    third: Complex[NDArray[np.complex128], " l"]
    exponent: float
    exponent_deviation: float
    phase: float | None
    configuration: str
    units: PlaceUnits = LINEAR

    @property
    def sentence(self) -> str:
        """Place, exponent and phase in words."""
        phase = "" if self.phase is None else f", at {self.phase:.0f} deg to the displacement ({PHASES})"
        half = TWO_SIDED_95 * self.exponent_deviation
        power = f" that grows with amplitude to the power {self.exponent:.1f} +- {half:.1f}"
        grows = power if np.isfinite(self.exponent_deviation) else ""
        return f"near {self.name}, a force{grows}{phase}, in the {self.configuration} structure"


def localise(arrangement: Arrangement, weights: Sequence[ProjectedCovariance]) -> list[UnknownForcePlace]:
    """Places ranked by the gain of an unknown force there, best first.

    Parameters
    ----------
    arrangement
        Measurements and model.
    weights
        Covariances of `list_covariances`.
    """
    fit, points = arrangement.fit, arrangement.train.features.points
    rows, frees = fit.model.places, (False, True)
    tangents = [item for row in rows.values() for free in frees for item in _make_tangents(fit.model, row, free)]
    # Each state is linearised once for all places.
    of_all = arrangement.train.predictor.derivatives(fit.model, fit.prediction, tangents)
    by_place = of_all.reshape(len(points), len(rows), 2, 4)
    fitted = [
        _fit_place(arrangement, weights, name, free, by_place[:, number, int(free)])
        for number, name in enumerate(rows)
        for free in frees
    ]
    places = [place for place in fitted if place is not None]
    return sorted(places, key=lambda place: -(place.gain - place.n_number))


def _fit_place(
    arrangement: Arrangement,
    weights: Sequence[ProjectedCovariance],
    name: str,
    free: bool,
    slopes: NDArray[np.complex128],
) -> UnknownForcePlace | None:
    """An unknown force at a place in one configuration; None if the model has no state.

    The force follows the amplitude at each frequency, which determines the exponent better than levels alone.
    """
    fit, points = arrangement.fit, arrangement.train.features.points
    row, solved = fit.model.places[name], {level for is_free, level, _ in fit.prediction.states if is_free == free}
    levels = np.array([level for level in np.unique(points.level[points.free == free]) if level in solved])
    if not len(levels):
        return None
    motion = _compute_motion(arrangement, row, free)
    largest = [_find_largest(arrangement, row, free, float(level)) for level in levels]
    amplitude = np.array([item for item, _ in largest])
    with_third = bool((points.harmonic[points.free == free] == 3).any())
    result = []
    for exponent in EXPONENTS:
        changes = _compute_changes(arrangement, free, levels, largest, slopes, motion, exponent)
        chosen = changes if with_third else changes[:, : 2 * len(levels)]
        result.append(_choose_weights([_fit_force(name, free, levels, amplitude, chosen, item) for item in weights]))
    place = replace(_combine_exponents(result), units=choose_units(fit.model, row))
    # Without phases of readings, the phase of the force follows from the scale of responses, as does model error.
    return place if arrangement.train.observed.phased.any() else replace(place, phase=None)


def find_common_phase(force: NDArray[np.complex128], certainty: NDArray[np.float64]) -> float | None:
    """Common phase of the forces of all levels that clearly exceed noise [deg]; None if it varies with the level.

    Parameters
    ----------
    force
        Force of each level, shape (l,) [N].
    certainty
        Size of each force in standard deviations, shape (l,).
    """
    clear = force[certainty >= min(CLEAR_FORCE, float(certainty.max()))]
    whole = clear.sum()
    if np.abs(whole) < np.cos(np.radians(SAME_KIND)) * np.abs(clear).sum():
        return None
    return float(np.degrees(np.angle(whole)))


def _choose_weights(by_weights: Sequence[UnknownForcePlace]) -> UnknownForcePlace:
    """The fit with the covariance that gives the largest gain; without a phase if that depends on the model error."""
    best = max(by_weights, key=lambda place: place.gain)
    phases = [place.phase for place in by_weights]
    if best.phase is None or any(
        phase is not None and abs((phase - best.phase + 180) % 360 - 180) > SAME_KIND for phase in phases
    ):
        return replace(best, phase=None)
    return best


def _compute_changes(
    arrangement: Arrangement,
    free: bool,
    levels: NDArray[np.float64],
    largest: Sequence[tuple[float, float]],
    slopes: NDArray[np.complex128],
    motion: NDArray[np.complex128],
    exponent: float,
) -> NDArray[np.float64]:
    """Derivatives of features with respect to both parts of kappa and lambda of each level, shape (m, 4 l)."""
    fit, train = arrangement.fit, arrangement.train
    points, kappa, third = train.features.points, [], []
    for level, (most, omega) in zip(levels, largest, strict=True):
        at = (points.level == level) & (points.free == free)
        share = np.zeros(len(points))
        if most > 0:
            share[at] = (np.abs(motion[at]) / most) ** (exponent - 1)
        # A dashpot c is an imaginary stiffness Omega c.
        kappa.append(share[:, None] * slopes[:, :2] / np.array([1.0, omega]))
        size = np.where(motion == 0, 1.0, np.abs(motion))
        turned = np.where(at, share * size / (most or 1.0) * (motion / size) ** 3, 0.0)
        # The response of a nonlinear structure has separate derivatives for real and imaginary part of a force. Loads
        # are defined for a level of 1 N.
        real, imaginary = slopes[:, 2] / level, slopes[:, 3] / level
        third.append(
            np.column_stack(
                [turned.real * real + turned.imag * imaginary, turned.real * imaginary - turned.imag * real]
            )
        )
    columns = []
    for parts in (*kappa, *third):
        features = train.features.slopes(fit.prediction.value, np.where(np.isfinite(parts), parts, 0.0))
        columns.append(np.where(np.isfinite(features), features, 0.0))
    return np.concatenate(columns, axis=1)


def _make_tangents(model: Model, row: NDArray[np.float64], free: bool) -> list[Tangent]:
    """Tangents of the real part of kappa, of a dashpot (imaginary part of kappa), and of both parts of lambda."""
    outer, third = np.outer(row, row), np.zeros((2, model.n_harmonic, len(row)), dtype=np.complex128)
    if model.n_harmonic > 3:
        third[:, 3] = row, 1j * row
    rates = [
        ModelParameter(matrices=MatrixParameter(stiffness=outer)),
        ModelParameter(matrices=MatrixParameter(damping=outer)),
        *(ModelParameter(harmonic_force=force) for force in third),
    ]
    return [Tangent(jointed=NOTHING if free else rate, free=rate if free else NOTHING, gain={}) for rate in rates]


def _compute_motion(arrangement: Arrangement, row: NDArray[np.float64], free: bool) -> NDArray[np.complex128]:
    """Fundamental of a row at each point of a configuration; 1 without a state, shape (k,) [m]."""
    prediction, points = arrangement.fit.prediction, arrangement.train.features.points
    keys = zip(points.free, points.level, points.frequency, strict=True)
    states = [prediction.states.get((bool(is_free), float(at), float(f))) for is_free, at, f in keys]
    return np.array(
        [
            state.coefficients[1] @ row if state is not None and state_free == free else 1.0
            for state, state_free in zip(states, points.free, strict=True)
        ],
        dtype=np.complex128,
    )


def _find_largest(arrangement: Arrangement, row: NDArray[np.float64], free: bool, level: float) -> tuple[float, float]:
    """Largest amplitude of a row at a level [m], and its angular frequency [rad/s]."""
    states = arrangement.fit.prediction.states
    there = [state for (is_free, at, _), state in states.items() if is_free == free and at == level]
    return max((state.amplitude(row), state.angular_frequency) for state in there)


def _fit_force(
    name: str,
    free: bool,
    levels: NDArray[np.float64],
    amplitude: NDArray[np.float64],
    changes: Matrix,
    weights: ProjectedCovariance,
) -> UnknownForcePlace:
    n, moves = len(levels), np.where(amplitude > 0, amplitude, 1.0)
    # kappa a and lambda are forces, so that the problem is well scaled for any size of motion.
    per_force = np.concatenate([changes[:, : 2 * n] / np.repeat(moves, 2), changes[:, 2 * n :]], axis=1)
    across, residual = weights.across(per_force), weights.residual
    solution, *_ = np.linalg.lstsq(across, residual, rcond=1e-10)
    covariance = np.linalg.pinv(across.T @ across, hermitian=True)
    forces = np.asarray(solution[0::2] + 1j * solution[1::2], dtype=np.complex128)
    spread = np.sqrt(np.diag(covariance)[0::2])
    third = np.zeros(n, dtype=np.complex128)
    third[: len(forces) - n] = forces[n:]
    # Both determine the exponent and the phase of the force.
    sizes = [(np.abs(forces[:n]), spread[:n]), (np.abs(third), spread[n:])]
    slopes = [_fit_exponent(amplitude, size, deviation) for size, deviation in sizes if len(deviation)]
    exponent, exponent_deviation = min(slopes, key=lambda pair: pair[1])
    return UnknownForcePlace(
        name=name,
        gain=float(residual @ across @ solution) - weights.cost_difference,
        n_number=len(solution),
        level=levels,
        amplitude=amplitude,
        stiffness=np.divide(forces[:n], moves),
        deviation=spread[:n] / moves,
        third=third,
        exponent=exponent,
        exponent_deviation=exponent_deviation,
        phase=find_common_phase(
            np.concatenate([-forces[:n], forces[n:]]), np.abs(forces) / np.where(spread > 0, spread, np.inf)
        ),
        configuration=name_configuration(free),
    )


def _combine_exponents(places: Sequence[UnknownForcePlace]) -> UnknownForcePlace:
    """Place with the exponent of the largest gain, combined with the exponent of the growth from level to level."""
    gains = np.array([place.gain for place in places])
    number = int(np.argmax(gains))
    best = places[number]
    if not 0 < number < len(places) - 1:
        return best
    # chi^2 rises by 1 at one standard deviation: a parabola through the best and its neighbours.
    bend = 2 * gains[number] - gains[number - 1] - gains[number + 1]
    if bend <= 0:
        return best
    within = EXPONENTS[number] + (gains[number + 1] - gains[number - 1]) / (2 * bend)
    sure, other = min(bend / 2, 1 / MIN_EXPONENT_DEVIATION**2), 1 / best.exponent_deviation**2
    return replace(
        best,
        exponent=float((sure * within + other * best.exponent) / (sure + other)),
        exponent_deviation=float(1 / np.sqrt(sure + other)),
    )


def _fit_exponent(
    amplitude: NDArray[np.float64], size: NDArray[np.float64], deviation: NDArray[np.float64]
) -> tuple[float, float]:
    """Slope of the logarithm of a force over that of the amplitude, weighted by the relative precision of forces."""
    seen = (amplitude > 0) & (deviation > 0) & (size > 0)
    if seen.sum() < 2:
        return 1.0, float("inf")
    x, y = np.log(amplitude[seen]), np.log(size[seen])
    weight = size[seen] / deviation[seen]
    table = np.column_stack([np.ones_like(x), x]) * weight[:, None]
    solution, *_ = np.linalg.lstsq(table, y * weight, rcond=None)
    covariance = np.linalg.pinv(table.T @ table)
    return float(solution[1]), float(np.sqrt(covariance[1, 1]))
