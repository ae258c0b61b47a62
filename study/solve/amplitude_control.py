"""Response control: a curve over frequency at a constant amplitude of a sensor."""

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
    """Amplitude of a sensor that the level of the harmonic force keeps constant.

    Parameters
    ----------
    sensor
        Name of the sensor.
    row
        Its row over all degrees of freedom, its gain in it, shape (r,) [-].
    derivative
        Whether it reads the displacement (0), the velocity (1) or the acceleration (2).
    amplitude
        Of the first harmonic of its reading [m, m/s or m/s^2].
    base_acceleration
        Acceleration of each degree of freedom with a shaken base at level 1, shape (r,) [m/s^2 / Omega^p]; None where
        none is in the reading.
    level_power
        p: levels are times Omega^p [-].
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
        """The curve between two Omega [rad/s], see `controlled_response`."""
        return controlled_response(
            balance, self.row, self.amplitude, first, last,
            derivative=self.derivative, base=self._base(balance), step=step, slider=slider, report=report,
        )  # fmt: skip

    def _base(self, balance: HarmonicBalance) -> BaseExcitation | None:
        """The base in the reading, whose motion and inertia are those of all degrees of freedom at level 1."""
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
