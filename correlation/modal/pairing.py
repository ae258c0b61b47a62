"""Pairing of measured modes and modes of the model, one to one, by shape and frequency."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.modal.assurance import Criterion, Shapes, compute_modal_assurance

Frequencies = Float[NDArray[np.float64], " m"]

#: Least MAC and largest ratio of frequencies of a pair [-].
LEAST_ASSURANCE, MOST_RATIO = 0.3, 1.5
#: Logarithm of the frequency ratio that halves the score of a pair; the shape decides between close frequencies [-].
HALF_SCORE = 0.2


@dataclass(frozen=True, kw_only=True)
class ModePair:
    """A measured mode and the corresponding mode of the model.

    Parameters
    ----------
    measured, model
        Indices of the modes.
    assurance
        MAC of their shapes [-].
    measured_frequency, model_frequency
        Frequencies [Hz].
    """

    measured: int
    model: int
    assurance: float
    measured_frequency: float
    model_frequency: float

    @property
    def frequency_error(self) -> float:
        """Relative frequency error of the model, positive if too high [-]."""
        return self.model_frequency / self.measured_frequency - 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairing:
    """All pairs, by measured mode, and unpaired modes.

    Parameters
    ----------
    pairs
        Pairs of corresponding modes.
    measured_only, model_only
        Indices of modes without a partner; of the model only those within the measured band.
    assurance
        MAC of all modes, shape (n_measured, n_model) [-].
    """

    pairs: tuple[ModePair, ...]
    measured_only: tuple[int, ...]
    model_only: tuple[int, ...]
    assurance: Criterion


def pair_modes(
    measured_frequency: Frequencies, measured: Shapes, model_frequency: Frequencies, model: Shapes
) -> Pairing:
    """The pairs with the largest sum of MAC times closeness in frequency.

    Parameters
    ----------
    measured_frequency, model_frequency
        Shape (n_measured,) and (n_model,) [Hz].
    measured, model
        Shapes at the same sensors, shape (n_sensor, n_measured) and (n_sensor, n_model).

    Raises
    ------
    CampaignError
        Different numbers of sensors, or a shape of zeros.
    """
    from scipy.optimize import linear_sum_assignment

    assurance = compute_modal_assurance(measured, model)
    first, second = np.asarray(measured_frequency), np.asarray(model_frequency)
    score = score_pairs(assurance, first, second)
    possible = (assurance >= LEAST_ASSURANCE) & (_compute_log_ratio(first, second) <= np.log(MOST_RATIO))
    rows, places = linear_sum_assignment(np.where(possible, score, 0.0), maximize=True)
    pairs = tuple(
        ModePair(
            measured=int(row),
            model=int(place),
            assurance=float(assurance[row, place]),
            measured_frequency=float(first[row]),
            model_frequency=float(second[place]),
        )
        for row, place in zip(rows, places, strict=True)
        if possible[row, place]
    )
    taken = {pair.model for pair in pairs}
    inside = np.flatnonzero((second >= first.min() * 0.95) & (second <= first.max() * 1.05)) if len(first) else ()
    return Pairing(
        pairs=pairs,
        measured_only=tuple(sorted(set(range(len(first))) - {pair.measured for pair in pairs})),
        model_only=tuple(int(place) for place in inside if place not in taken),
        assurance=assurance,
    )


def score_pairs(assurance: Criterion, measured_frequency: Frequencies, model_frequency: Frequencies) -> Criterion:
    """MAC times closeness in frequency of all pairs, shape (n_measured, n_model) [-].

    Parameters
    ----------
    assurance
        MAC, shape (n_measured, n_model) [-].
    measured_frequency, model_frequency
        Shape (n_measured,) and (n_model,) [Hz].
    """
    return np.asarray(assurance * 0.5 ** ((_compute_log_ratio(measured_frequency, model_frequency) / HALF_SCORE) ** 2))


def _compute_log_ratio(first: Frequencies, second: Frequencies) -> Criterion:
    """Absolute logarithm of all ratios of frequencies."""
    return np.asarray(np.abs(np.log(second[None, :] / first[:, None])))
