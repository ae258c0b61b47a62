r"""What errors of the model's frequencies make of the parameters that resonances tell.

The tangential stiffness is told by the stuck resonance, and the density of the blade by the free one, as far as the
frequencies of the model are right. Two errors are in both: numerical error, and the springs of the root, which are
assumed. To first order a relative error of the stuck frequency is made up for by

.. math:: \frac{\delta k_t}{k_t} = -\frac{\delta f}{f} \Big/ \frac{d \ln f}{d \ln k_t} .

Another root moves both resonances. Where the free one was measured, the density keeps it in its place, and what is left
of the stuck one counts.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, hypot, log

from correlation.model import Model
from pipeline.store import stage
from study.case.tables import Case
from study.kind.rig.table import RigTable
from study.paper.parameters import RigParameters
from study.paper.resonance import find_small_peak

#: Relative standard deviation of springs of a root that nobody measured [-].
ROOT_DEVIATION = 0.2
#: Relative change of the stiffness over which the stuck resonance is differentiated [-].
CHANGE = 0.02


@dataclass(frozen=True, kw_only=True)
class FrequencyError:
    """Relative standard deviations by errors of the model's frequencies.

    Parameters
    ----------
    kt
        Of the tangential stiffness [-].
    density
        Of the density of the blade; 0 where it was not calibrated [-].
    """

    kt: float
    density: float


@stage("errors of the rig's frequencies", ignore=("make",))
def find_frequency_error(
    case: Case[RigTable],  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    parameters: RigParameters,
    numerical: float,
    free_measured: bool,
    make: Callable[[RigParameters], Model],
) -> FrequencyError:
    """How far kt and the density may be off by errors of the model's frequencies.

    Parameters
    ----------
    case
        Case of the rig, on which the models depend.
    parameters
        Calibrated parameters. A root without springs is taken as right.
    numerical
        Relative standard deviation of the stuck resonance by numerical error [-].
    free_measured
        Whether the density was calibrated to a free resonance.
    make
        Makes the model of some parameters.
    """

    def find(changed: RigParameters, *, free: bool) -> float:
        return log(find_small_peak(make(changed), free=free).frequency)

    stuck = find(parameters, free=False)
    slope = (find(replace(parameters, kt=(1 + CHANGE) * parameters.kt), free=False) - stuck) / log(1 + CHANGE)
    if parameters.root is None:
        return FrequencyError(kt=numerical / slope, density=0.0)
    other, lighter = replace(parameters, root=(1 + ROOT_DEVIATION) * parameters.root), 0.0
    if free_measured and parameters.density is not None:
        lighter = 2 * (find(other, free=True) - find(parameters, free=True))
        other = replace(other, density=exp(lighter) * parameters.density)
    by_root = find(other, free=False) - stuck
    return FrequencyError(kt=hypot(numerical, by_root) / slope, density=abs(lighter))
