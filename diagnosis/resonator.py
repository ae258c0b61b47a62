r"""Search for a small resonator attached at a place: a cable, a loose part, an absorber.

A mass m on a spring, with natural frequency omega_r and damping ratio zeta_r, loads a place with an apparent mass that
changes sign at its resonance (Den Hartog, Mechanical Vibrations, section 3.2),

.. math:: \mu(\omega) = m\, \frac{\omega_r^2 + 2 i \zeta_r \omega_r \omega}
          {\omega_r^2 - \omega^2 + 2 i \zeta_r \omega_r \omega} .

An effect with the same strength at all frequencies cannot do this. To first order in m the readings change by Re mu
times their derivative with respect to a mass at the place, and -omega Im mu times that with respect to a dashpot. The
whitened residual is fitted with m at each place for a grid of omega_r and zeta_r, the calibration parameters projected
out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model_solver import Tangent
from diagnosis.candidate.place import choose_units
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Matrix
from diagnosis.model_error_share import ProjectedCovariance
from hbsolve.model_rates import MatrixParameter, ModelParameter

NOTHING = ModelParameter()
#: Damping ratios that are tried [-].
DAMPING = (0.005, 0.02, 0.08)
#: Relative margin of the tried natural frequencies beyond the tested band [-].
BAND_MARGIN = 0.1
#: Difference of gains below which places are indistinguishable: odds of 1 to 20.
SAME_GAIN = 2 * np.log(20)


@dataclass(frozen=True, kw_only=True)
class Resonator:
    """A resonator at a place that explains the residual.

    Parameters
    ----------
    name
        Name of the place in the model.
    configuration
        Configuration in which the resonator is missing: "jointed" or "free".
    gain
        Fall of chi^2 [-].
    mass, deviation
        Mass, or moment of inertia where the place is an angle, and its standard deviation at this tuning, to first
        order [`unit`].
    unit
        "kg" or "kg m^2".
    frequency
        Natural frequency [Hz].
    damping
        Damping ratio [-].
    n_number
        Number of fitted parameters: mass, natural frequency and damping ratio [-].
    alike
        Resonators at other places that the data cannot distinguish from this one: a single mode does not determine the
        place.
    """

    name: str
    configuration: str
    gain: float
    mass: float
    deviation: float
    frequency: float
    damping: float
    n_number: int = 3
    unit: str = "kg"
    alike: tuple["Resonator", ...] = ()

    @property
    def sentence(self) -> str:
        """Natural frequency, and size by place, in words."""
        where = " or ".join(f"{item.size} at {item.name}" for item in (self, *self.alike))
        return (
            f"a small attached resonator at {self.frequency:.4g} Hz, such as a cable or a loose part, with about "
            f"{where} (to first order), in the {self.configuration} structure"
        )

    @property
    def size(self) -> str:
        """Mass or moment of inertia in words."""
        mass, unit = (1e3 * self.mass, "g") if self.unit == "kg" and self.mass < 0.1 else (self.mass, self.unit)
        return f"{mass:.2g} {unit}"


def find_resonators(arrangement: Arrangement, weights: Sequence[ProjectedCovariance]) -> list[Resonator]:
    """The best resonator at each place in each configuration, best first; only those with a gain.

    Parameters
    ----------
    arrangement
        Measurements and model.
    weights
        Covariances of `list_covariances`.
    """
    train, fit = arrangement.train, arrangement.fit
    points, places, result = train.features.points, list(fit.model.places.items()), list[Resonator]()
    tangents = [item for _, row in places for item in _make_tangents(row)]
    slopes = train.predictor.derivatives(fit.model, fit.prediction, tangents).reshape(len(points), len(places), 2, 2)
    for configuration, there in (("jointed", ~points.free), ("free", points.free)):
        tunings = list_tunings(points.frequency[there]) if there.any() else []
        for number, (name, row) in enumerate(places if tunings else ()):
            own = np.where(there[:, None], slopes[:, number, int(configuration == "free")], 0.0)
            changes = _compute_changes(arrangement, own, tunings)
            fits = [_fit(item, changes) for item in weights]
            gain, mass, deviation, tuning = max(fits)
            if gain > 0:
                frequency, damping = tunings[tuning]
                result.append(
                    Resonator(
                        name=name, configuration=configuration, gain=gain, mass=mass, deviation=deviation,
                        frequency=frequency, damping=damping, unit=choose_units(fit.model, row).inertia,
                    )
                )  # fmt: skip
    return [replace(item, alike=_list_alike(item, result)) for item in sorted(result, key=lambda item: -item.gain)]


def _list_alike(resonator: Resonator, resonators: Sequence[Resonator]) -> tuple[Resonator, ...]:
    """Those at other places of the same configuration with a gain within `SAME_GAIN`."""
    near = sorted(
        (item for item in resonators if abs(item.gain - resonator.gain) < SAME_GAIN), key=lambda item: -item.gain
    )
    return tuple(item for item in near if item.configuration == resonator.configuration and item.name != resonator.name)


def list_tunings(frequency: Float[NDArray[np.float64], " k"]) -> list[tuple[float, float]]:
    """Natural frequencies [Hz] and damping ratios [-] that are tried for tests at some frequencies [Hz]."""
    low, high = np.log(frequency.min() * (1 - BAND_MARGIN)), np.log(frequency.max() * (1 + BAND_MARGIN))
    return [
        (float(np.exp(item)), damping)
        for damping in DAMPING
        for item in np.linspace(low, high, 2 + int((high - low) / damping))
    ]


def _make_tangents(row: Float[NDArray[np.float64], " r"]) -> list[Tangent]:
    """A mass and a dashpot at a row, each in the jointed and in the free structure."""
    outer = np.outer(row, row)
    kinds = [MatrixParameter(mass=outer), MatrixParameter(damping=outer)]
    rates = [ModelParameter(matrices=item) for item in kinds]
    return [
        *(Tangent(jointed=rate, free=NOTHING, gain={}) for rate in rates),
        *(Tangent(jointed=NOTHING, free=rate, gain={}) for rate in rates),
    ]


def _compute_changes(
    arrangement: Arrangement, slopes: Complex[NDArray[np.complex128], "k 2"], tunings: Sequence[tuple[float, float]]
) -> Matrix:
    """Change of the features by 1 kg of each tuning, shape (m, t)."""
    train, fit = arrangement.train, arrangement.fit
    at = train.features.points.frequency[:, None]
    natural, damping = np.array(tunings).T
    loss = 2j * damping * natural * at
    apparent = (natural**2 + loss) / (natural**2 - at**2 + loss)
    values = slopes[:, :1] * apparent.real - 2 * np.pi * at * slopes[:, 1:] * apparent.imag
    features = train.features.slopes(fit.prediction.value, np.where(np.isfinite(values), values, 0.0))
    return np.where(np.isfinite(features), features, 0.0)


def _fit(weights: ProjectedCovariance, changes: Matrix) -> tuple[float, float, float, int]:
    """Gain of the best tuning with one covariance, mass, standard deviation of the mass, and index of the tuning."""
    across = weights.across(changes)
    size = np.linalg.norm(across, axis=0)
    size[size == 0] = np.inf
    along = weights.residual @ across / size
    best = int(np.argmax(along))
    # A mass is positive.
    gain = max(float(along[best]), 0.0) ** 2 - weights.cost_difference
    return gain, float(along[best] / size[best]), float(1 / size[best]), best
