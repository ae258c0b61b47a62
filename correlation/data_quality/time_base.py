"""Ring-downs with a wrong time base: a common factor on time explains the frequencies of all modes of a model."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Suspicion
from correlation.data_quality.frequency_unit import SAME_FREQUENCY
from correlation.data_type.backbone import MAX_FREQUENCY_FACTOR
from correlation.data_type.mode import compute_linear_modes
from correlation.data_type.ring_down import FreeDecay
from correlation.model import Model

Frequencies = Float[NDArray[np.float64], " m"]

#: Mistakes of a time base, by the ratio of measured to true frequencies.
TIME_BASE_MISTAKES = {
    1e-6: "are its times in us and read as s", 1e-3: "are its times in ms and read as s",
    1e3: "are its times in s and read as ms", 0.5: "is its sampling rate twice what the times say",
    2.0: "is its sampling rate half of what the times say",
}  # fmt: skip
#: Tolerance for the agreement of frequencies after the correction, for several modes and for one [natural logarithm].
#: Of 20,000 random chains of up to six masses, with models whose masses and springs have errors of up to 40 % each,
#: none with several modes passes, and 0.5 % of those with one.
TOGETHER, ALONE = 0.05, 0.02
LISTED = 4


def find_wrong_time_base(model: Model, decay: FreeDecay) -> Iterator[Suspicion]:
    """A wrong time base, otherwise a remark on modes without a mode of the model nearby, with the frequencies of both.

    Parameters
    ----------
    model
        Model.
    decay
        Ring-down with its modes.
    """
    measured = np.array([float(mode.frequency[np.argmin(mode.amplitude)]) for mode in decay.modes])
    frequency = compute_linear_modes(model, decay.configuration)[0]
    frequency = frequency[frequency > 0]
    if not len(measured) or not len(frequency):
        return
    result = find_time_base_factor(measured, frequency)
    lost = _compute_distance(measured, frequency) > np.log(MAX_FREQUENCY_FACTOR)
    both = f"the modes of the model are at {_list(frequency)} Hz"
    if result is not None:
        yield Suspicion(
            where=decay.name,
            sentence=(
                f"its modes are at {_list(measured)} Hz, and {both}: each is {result:.4g} times one of these, and none "
                f"is near one as stated: {TIME_BASE_MISTAKES[result]}? If so, correct the unit or the rate of its time"
            ),
        )
    elif lost.any():
        yield Suspicion(
            where=decay.name,
            sentence=f"its modes at {_list(measured[lost])} Hz are not compared, because {both}, none within a factor "
            f"of {MAX_FREQUENCY_FACTOR:g}",
            remark=True,
        )


def find_time_base_factor(measured: Frequencies, model: Frequencies) -> float | None:
    """The factor of `TIME_BASE_MISTAKES` that corrects all measured frequencies; None if one needs no correction.

    Parameters
    ----------
    measured, model
        Frequencies, shape (m,) [Hz] each.
    """
    if _compute_distance(measured, model).min() < SAME_FREQUENCY:
        return None
    near = TOGETHER if len(measured) > 1 else ALONE
    best = min(TIME_BASE_MISTAKES, key=lambda factor: float(_compute_distance(measured, factor * model).max()))
    return best if _compute_distance(measured, best * model).max() < near else None


def _compute_distance(measured: Frequencies, model: Frequencies) -> Frequencies:
    """Distance of each measured frequency from the nearest of the model, shape (m,) [natural logarithm]."""
    return np.asarray(np.abs(np.log(measured[:, None] / model)).min(axis=1))


def _list(frequencies: Frequencies) -> str:
    more = ", ..." if len(frequencies) > LISTED else ""
    return ", ".join(f"{item:.4g}" for item in frequencies[:LISTED]) + more
