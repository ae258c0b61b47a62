"""Response control: curves over frequency at a constant amplitude of a sensor."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.controlled_response import controlled_response
from reduction.base_excitation import LEVEL_POWER, BaseExcitation, BaseMotion

Row = Float[NDArray[np.float64], " r"]


@dataclass(frozen=True, kw_only=True, eq=False)
class AmplitudeControl:
    """Amplitude of a sensor that is kept constant by the level of the harmonic force.

    Parameters
    ----------
    sensor
        Name of the sensor.
    row
        Row of the sensor over all degrees of freedom, including its gain, shape (r,) [-].
    derivative
        Quantity of the sensor: displacement (0), velocity (1) or acceleration (2).
    amplitude
        Amplitude of the first harmonic of the reading [m, m/s or m/s^2].
    base_acceleration
        Acceleration of each degree of freedom with a moving base at level 1, shape (r,) [m/s^2 / Omega^p]; None if the
        reading does not include it.
    level_power
        Power p of the factor Omega^p on levels [-].
    """

    sensor: str
    row: Row
    derivative: int
    amplitude: float
    base_acceleration: Complex[NDArray[np.complex128], " r"] | None = None
    level_power: int = 0

    def compute_curve(
        self,
        balance: HarmonicBalance,
        first: float,
        last: float,
        *,
        step: float | None,
        slider: Row | None,
        report: Callable[[float, float], None],
    ) -> ResponseBranch:
        """Compute the curve between two angular frequencies [rad/s], see `controlled_response`."""
        return controlled_response(
            balance, self.row, self.amplitude, first, last,
            derivative=self.derivative, base=self._base(balance), step=step, slider=slider, report=report,
        )  # fmt: skip

    def _base(self, balance: HarmonicBalance) -> BaseExcitation | None:
        """Make the base excitation that the reading includes, from the motions and inertia loads at level 1."""
        if self.base_acceleration is None:
            return None
        largest = self.base_acceleration[int(np.argmax(np.abs(self.base_acceleration)))]
        turn = largest / abs(largest)
        quantity = {power: name for name, power in LEVEL_POWER.items()}[self.level_power]
        motion = BaseMotion(
            motion=(self.base_acceleration / turn).real,
            inertia=-(balance.structure.dynamic[1, : len(self.base_acceleration)] / turn).real,
        )
        return BaseExcitation(base=motion, amplitude=complex(turn / 1j**self.level_power), quantity=quantity)
