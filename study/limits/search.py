"""What a search for limits depends on, and nothing else."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import ComputationFailed
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.limits.objective import Objective
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.search import LimitSettings
from reduction.jointed_system import JointedSystem

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitSearch:
    """All that limits depend on.

    Parameters
    ----------
    system
        With its loads at level 1.
    harmonics, n_sample
        H, and samples a period, 0 for the solver's choice [-].
    objective
        What is bounded.
    harmonic
        The one that amplitudes are of [-].
    row
        Of the output whose amplitude is bounded, or, for the loss factor, given where that is extreme, shape (r,); None
        for forces.
    angular_frequency, levels
        Ascending [rad/s, -].
    nominal
        Centre of the box, shape (s,) [m]; None for rest under the static load.
    reach
        w_max [m]; None for the default.
    settings
        How hard to search.
    """

    system: JointedSystem
    harmonics: int
    n_sample: int
    objective: Objective
    harmonic: int
    row: Float[Real, " r"] | None
    angular_frequency: tuple[float, ...]
    levels: tuple[float, ...]
    nominal: Float[Real, " s"] | None
    reach: float | None
    settings: LimitSettings

    def balance(self) -> HarmonicBalance:
        """What is solved."""
        return HarmonicBalance(system=self.system, n_harmonic=self.harmonics + 1, n_sample=self.n_sample)

    def problem(self) -> LimitProblem:
        """The problem of the search.

        Raises
        ------
        BalanceError
            As `limit_problem`.
        ComputationFailed
            There is no rest under the static load.
        """
        try:
            return limit_problem(self.balance(), self.objective, nominal=self.nominal, reach=self.reach)
        except NoSteadyState as error:
            raise ComputationFailed(f"limits: {error}") from error
