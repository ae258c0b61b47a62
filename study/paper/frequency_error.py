r"""What errors of the model's frequencies make of the parameters that resonances tell.

The tangential stiffness is told by the stuck resonance, and the density of the blade by the free one, as far as the
frequencies of the model are right. Two errors are in both: numerical error, and the springs of the root, which are
assumed. To first order a relative error of the stuck frequency is made up for by

.. math:: \frac{\delta k_t}{k_t} = -\frac{\delta f}{f} \Big/ \frac{d \ln f}{d \ln k_t} .

Another root moves both resonances. Where the free one was measured, the density keeps it in its place, and what is left
of the stuck one counts.
"""

from dataclasses import dataclass, replace
from math import exp, hypot, log

from pipeline.store import stage
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import RigParameters
from study.paper.resonance import find_small_peak

#: Relative standard deviation of springs of a root that nobody measured [-].
ROOT_DEVIATION = 0.2
#: Relative change of the stiffness over which the stuck resonance is differentiated [-].
CHANGE = 0.02
#: Least d ln f / d ln kt: contacts that are far stiffer than the structure hardly move the resonance [-].
MIN_SLOPE = 1e-3


@dataclass(frozen=True, kw_only=True)
class FrequencyError:
    """Relative standard deviations by errors of the model's frequencies.

    Parameters
    ----------
    kt
        Of the tangential stiffness [-].
    density
        Of the density of the blade; 0 where no free resonance tells it [-].
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
    """How far kt and the density may be off by errors of the model's frequencies.

    Parameters
    ----------
    inputs
        What the models depend on.
    parameters
        Calibrated parameters. A root without springs is taken as right.
    stuck_error, free_error
        Relative standard deviations of the stuck and of the free resonance by numerical error; None where no free
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
