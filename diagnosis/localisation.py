r"""Where a force is missing, and of what sort, without any catalogue.

A missing force f at a place with row p of the calibrated model changes the response as an unknown stiffness would,

.. math:: f = -\kappa(a)\, u, \qquad u = p \cdot q

with a complex kappa of its own for each level: positive real for a spring, negative real for a mass, imaginary for
damping. For each place the whitened residual is fitted with kappa at all levels, the accepted parameters projected
out; the place that explains most is where the force is, kappa over the amplitude there says the exponent, its phase the
kind.

Phases of the missing force relative to the displacement: 180 deg spring, 0 deg inertia, -90 deg damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.prediction import Tangent
from diagnosis.arrangement import Arrangement
from diagnosis.screening import accepted_basis
from hbsolve.sensitivity import MatrixParameter, ModelParameter

NOTHING = ModelParameter()


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
    fit, train = arrangement.fit, arrangement.train
    basis = accepted_basis(arrangement)
    residual = fit.residual - basis @ (basis.T @ fit.residual)
    points = train.features.points
    places = []
    for name, row in fit.model.places.items():
        found = []
        for free in (False, True):
            levels = np.unique(points.level[points.free == free])
            if not len(levels):
                continue
            tangents = _tangents(row, free)
            slopes = train.predictor.derivatives(fit.model, fit.prediction, tangents)
            columns = []
            for level in levels:
                at = (points.level == level) & (points.free == free)
                features = train.features.slopes(fit.prediction.value, np.where(at[:, None], slopes, 0.0))
                columns.append(train.whitening(np.where(np.isfinite(features), features, 0.0)))
            changes = np.concatenate([np.concatenate(columns, axis=1), np.zeros((len(fit.values), 2 * len(levels)))])
            across = changes - basis @ (basis.T @ changes)
            amplitude = np.array([_amplitude(arrangement, row, free, float(level)) for level in levels])
            found.append(_place(name, free, levels, amplitude, across, residual))
        places += found
    return sorted(places, key=lambda place: -(place.gain - place.n_number))


def _tangents(row: NDArray[np.float64], free: bool) -> list[Tangent]:
    """Of the real part of kappa, and of a dashpot for its imaginary part."""
    outer = np.outer(row, row)
    rates = [
        ModelParameter(matrices=MatrixParameter(stiffness=outer)),
        ModelParameter(matrices=MatrixParameter(damping=outer)),
    ]
    return [Tangent(jointed=NOTHING if free else rate, free=rate if free else NOTHING, gain={}) for rate in rates]


def _amplitude(arrangement: Arrangement, row: NDArray[np.float64], free: bool, level: float) -> float:
    states = arrangement.fit.prediction.states
    there = [state for (is_free, at, _), state in states.items() if is_free == free and at == level]
    return max(state.amplitude(row) for state in there)


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
    largest = int(np.argmax(np.abs(kappa) / deviation))
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
    amplitude: Sequence[float] | NDArray[np.float64], size: NDArray[np.float64], deviation: NDArray[np.float64]
) -> tuple[float, float]:
    """Slope of log |kappa a| over log a, weighted by how well each kappa is known."""
    x, y = np.log(np.asarray(amplitude)), np.log(np.maximum(size, 1e-300) * amplitude)
    weight = size / deviation
    if len(x) < 2 or weight.max() == 0:
        return 1.0, float("inf")
    table = np.column_stack([np.ones_like(x), x]) * weight[:, None]
    solution, *_ = np.linalg.lstsq(table, y * weight, rcond=None)
    covariance = np.linalg.pinv(table.T @ table)
    return float(solution[1]), float(np.sqrt(covariance[1, 1]))
