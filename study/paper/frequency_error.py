r"""Errors of parameters identified from resonances that are due to errors of the model's frequencies.

The stuck resonance determines the tangential stiffness, and the free one the density of the blade, if the frequencies
of the model are correct. Two errors affect both: the numerical error, and the assumed stiffness of the springs of the
root. To first order a relative error of the stuck frequency is compensated by

.. math:: \frac{\delta k_t}{k_t} = -\frac{\delta f}{f} \Big/ \frac{d \ln f}{d \ln k_t} .

Another stiffness of the root moves both resonances. If the free one was measured, the density compensates its shift,
and only the remaining shift of the stuck one counts.
"""

from dataclasses import dataclass, replace
from math import exp, hypot, log

from pipeline.store import stage
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import RigParameters
from study.paper.resonance import find_small_peak

#: Relative standard deviation of the stiffness of an unmeasured root [-].
ROOT_DEVIATION = 0.2
#: Relative change of the stiffness over which the stuck resonance is differentiated [-].
CHANGE = 0.02
#: Least d ln f / d ln kt: contacts that are far stiffer than the structure hardly move the resonance [-].
MIN_SLOPE = 1e-3


@dataclass(frozen=True, kw_only=True)
class FrequencyError:
    """Relative standard deviations of parameters due to errors of the model's frequencies.

    Parameters
    ----------
    kt
        That of the tangential stiffness [-].
    density
        That of the density of the blade; 0 without a free resonance [-].
    """

    kt: float
    density: float


@stage("errors of the rig's frequencies", ignore=("make",))
def find_frequency_error(
    inputs: ModelInputs,  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    parameters: RigParameters,
    stuck_error: float,
    free_error: float | None,
    make: PaperModel,
) -> FrequencyError:
    """Standard deviations of kt and the density due to errors of the model's frequencies.

    Parameters
    ----------
    inputs
        What the models depend on.
    parameters
        Calibrated parameters. A root without springs is taken as exact.
    stuck_error, free_error
        Relative standard deviations of the stuck and of the free resonance due to numerical error; None if no free
        resonance was measured [-].
    make
        Makes the model of some parameters.
    """

    def find(changed: RigParameters, *, free: bool) -> float:
        return log(find_small_peak(make(changed), free=free).frequency)

    stuck, by_root, density_change = find(parameters, free=False), 0.0, 0.0
    slope = (find(replace(parameters, kt=(1 + CHANGE) * parameters.kt), free=False) - stuck) / log(1 + CHANGE)
    if parameters.root is not None:
        other = replace(parameters, root=(1 + ROOT_DEVIATION) * parameters.root)
        if free_error is not None and parameters.density is not None:
            density_change = 2 * (find(other, free=True) - find(parameters, free=True))
            other = replace(other, density=exp(density_change) * parameters.density)
        by_root = find(other, free=False) - stuck
    return FrequencyError(
        kt=hypot(stuck_error, by_root) / max(slope, MIN_SLOPE),
        density=0.0 if free_error is None else hypot(density_change, 2 * free_error),
    )
