r"""Where a force is missing, and of what sort, without any catalogue.

A missing force f at a place with row p of the calibrated model changes the response as an unknown stiffness would,

.. math:: f = -\kappa(a)\, u, \qquad u = p \cdot q

with a complex kappa of its own for each level: positive real for a spring, negative real for a mass, imaginary for
damping. Within a level it follows the amplitude by the exponent. For each place the whitened residual is fitted with
kappa at all levels, the accepted parameters projected out; the place that explains most is where the force is, kappa
over the amplitude there says the exponent, its phase the kind.

Phases of the missing force relative to the displacement: 180 deg spring, 0 deg inertia, -90 deg damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.configuration import Tangent
from diagnosis.arrangement import Arrangement
from diagnosis.screening import accepted_basis
from hbsolve.sensitivity import MatrixParameter, ModelParameter

NOTHING = ModelParameter()
#: Fits of each place, and exponents of the amplitude that they may suppose.
ROUNDS, EXPONENTS = 3, (0.0, 4.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A place at which an unknown force explains the residual.

    Parameters
    ----------
    name
        Of the model's places.
    gain
        Fall of chi^2.
    n_number
        Numbers fitted: real and imaginary part of kappa a level and configuration.
    level, amplitude
        Levels, and the amplitude of the place at its largest response there, shape (l,) [N, m].
    stiffness
        kappa, shape (l,) [N/m].
    deviation
        Standard deviation of kappa's parts, shape (l,) [N/m].
    exponent
        p of f ~ a^p: 1 for what is linear, 2 for air, 3 for a cubic spring.
    exponent_deviation
        Its standard deviation.
    phase
        Of the force relative to the displacement [deg].
    configuration
        "jointed", "free" or "both": where it is missing.
    """

    name: str
    gain: float
    n_number: int
    level: Float[NDArray[np.float64], " l"]
    amplitude: Float[NDArray[np.float64], " l"]
    stiffness: Complex[NDArray[np.complex128], " l"]
    deviation: Float[NDArray[np.float64], " l"]
    exponent: float
    exponent_deviation: float
    phase: float
    configuration: str

    @property
    def sentence(self) -> str:
        """In words."""
        return (
            f"near {self.name}, a force that grows with amplitude to the power {self.exponent:.1f} "
            f"+- {2 * self.exponent_deviation:.1f}, at {self.phase:.0f} deg to the displacement (180 spring, 0 mass, "
            f"-90 damping), in the {self.configuration} structure"
        )


def localise(arrangement: Arrangement) -> list[Place]:
    """Places by what an unknown force there explains, best first."""
    fit = arrangement.fit
    basis = accepted_basis(arrangement)
    residual = fit.residual - basis @ (basis.T @ fit.residual)
    points = arrangement.train.features.points
    places = []
    for name, row in fit.model.places.items():
        tangents = [*_tangents(row, False), *_tangents(row, True)]
        both = arrangement.train.predictor.derivatives(fit.model, fit.prediction, tangents)
        for free, slopes in ((False, both[:, :2]), (True, both[:, 2:])):
            levels = np.unique(points.level[points.free == free])
            if not len(levels):
                continue
            largest = [_largest(arrangement, row, free, float(level)) for level in levels]
            amplitude = _amplitudes(arrangement, row, free)
            exponent, found = 1.0, []
            # kappa is as large as the amplitude makes it at each frequency: first alike, then by the exponent found.
            for _ in range(ROUNDS):
                changes = _changes(arrangement, free, levels, largest, slopes, amplitude, exponent)
                across = changes - basis @ (basis.T @ changes)
                found.append(_place(name, free, levels, np.array([each for each, _ in largest]), across, residual))
                exponent = float(np.clip(found[-1].exponent, *EXPONENTS))
            places.append(max(found, key=lambda place: place.gain))
    return sorted(places, key=lambda place: -(place.gain - place.n_number))


def _changes(
    arrangement: Arrangement,
    free: bool,
    levels: NDArray[np.float64],
    largest: Sequence[tuple[float, float]],
    slopes: NDArray[np.complex128],
    amplitude: NDArray[np.float64],
    exponent: float,
) -> NDArray[np.float64]:
    """Whitened change with the parts of kappa at the largest amplitude of each level, shape (m + p, 2 l)."""
    fit, train = arrangement.fit, arrangement.train
    points, columns = train.features.points, []
    for level, (most, omega) in zip(levels, largest, strict=True):
        at = (points.level == level) & (points.free == free)
        share = np.zeros(len(points))
        if most > 0:
            share[at] = (amplitude[at] / most) ** (exponent - 1)
        # A dashpot c is an imaginary stiffness Omega c.
        parts = share[:, None] * np.where(at[:, None], slopes, 0.0) / np.array([1.0, omega])
        features = train.features.slopes(fit.prediction.value, parts)
        columns.append(train.whitening(np.where(np.isfinite(features), features, 0.0)))
    return np.concatenate([np.concatenate(columns, axis=1), np.zeros((len(fit.values), 2 * len(levels)))])


def _tangents(row: NDArray[np.float64], free: bool) -> list[Tangent]:
    """Of the real part of kappa, and of a dashpot for its imaginary part."""
    outer = np.outer(row, row)
    rates = [
        ModelParameter(matrices=MatrixParameter(stiffness=outer)),
        ModelParameter(matrices=MatrixParameter(damping=outer)),
    ]
    return [Tangent(jointed=NOTHING if free else rate, free=rate if free else NOTHING, gain={}) for rate in rates]


def _amplitudes(arrangement: Arrangement, row: NDArray[np.float64], free: bool) -> NDArray[np.float64]:
    """Amplitude of a row at each point of a configuration; 1 where there is no state, shape (k,) [m]."""
    prediction, points = arrangement.fit.prediction, arrangement.train.features.points
    keys = zip(points.free, points.level, points.frequency, strict=True)
    states = [prediction.states.get((bool(is_free), float(at), float(f))) for is_free, at, f in keys]
    return np.array(
        [
            state.amplitude(row) if state is not None and state_free == free else 1.0
            for state, state_free in zip(states, points.free, strict=True)
        ]
    )


def _largest(arrangement: Arrangement, row: NDArray[np.float64], free: bool, level: float) -> tuple[float, float]:
    """Largest amplitude of a row at a level [m], and where [rad/s]."""
    states = arrangement.fit.prediction.states
    there = [state for (is_free, at, _), state in states.items() if is_free == free and at == level]
    return max((state.amplitude(row), state.angular_frequency) for state in there)


def _place(
    name: str,
    free: bool,
    levels: NDArray[np.float64],
    amplitude: NDArray[np.float64],
    across: NDArray[np.float64],
    residual: NDArray[np.float64],
) -> Place:
    solution, *_ = np.linalg.lstsq(across, residual, rcond=1e-10)
    covariance = np.linalg.pinv(across.T @ across, hermitian=True)
    kappa = solution[0::2] + 1j * solution[1::2]
    deviation = np.sqrt(np.diag(covariance)[0::2])
    exponent, spread = _exponent(amplitude, np.abs(kappa), deviation)
    largest = int(np.argmax(np.abs(kappa) / np.where(deviation > 0, deviation, np.inf)))
    return Place(
        name=name,
        gain=float(residual @ across @ solution),
        n_number=len(solution),
        level=levels,
        amplitude=amplitude,
        stiffness=kappa,
        deviation=deviation,
        exponent=exponent,
        exponent_deviation=spread,
        phase=float(np.degrees(np.angle(-kappa[largest]))),
        configuration="free" if free else "jointed",
    )


def _exponent(
    amplitude: NDArray[np.float64], size: NDArray[np.float64], deviation: NDArray[np.float64]
) -> tuple[float, float]:
    """Slope of log |kappa a| over log a, weighted by how well each kappa is known."""
    seen = (amplitude > 0) & (deviation > 0) & (size > 0)
    if seen.sum() < 2:
        return 1.0, float("inf")
    x, y = np.log(amplitude[seen]), np.log(size[seen] * amplitude[seen])
    weight = size[seen] / deviation[seen]
    table = np.column_stack([np.ones_like(x), x]) * weight[:, None]
    solution, *_ = np.linalg.lstsq(table, y * weight, rcond=None)
    covariance = np.linalg.pinv(table.T @ table)
    return float(solution[1]), float(np.sqrt(covariance[1, 1]))
