"""Measured frequency response with its modes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.data_type.mode import MeasuredMode
from correlation.modal.fit_modes import Modes
from correlation.modal.window import Window
from correlation.signal.frequency_response import LEAST_COHERENCE
from geometry.read_only_array import freeze_fields

Frequencies = Float[NDArray[np.float64], " f"]


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredResponse:
    """Frequency responses to one force.

    Parameters
    ----------
    name
        As in the manifest.
    test
        Number of its test among those of the campaign.
    configuration
        "jointed", or "free" of all contacts.
    sensors
        Names of the sensors.
    frequency
        Rising, shape (f,) [Hz].
    value
        Response per unit of the drive, e^{+i Omega t}, shape (c, f) [unit of each sensor per unit of the drive]; NaN
        where a sensor has no value.
    units
        Unit of each row of `value`, in words.
    coherence
        Shape (c, f); 1 where it is not known [-].
    coherence_limit
        Coherence from which a value tells the response and not the noise [-].
    level
        Amplitude of the drive that the response stands for [its unit]; None if it is not stated.
    repeat
        Number of the repeat.
    held_out
        Whether no calibration may see it.
    window
        Window under which it was estimated.
    decay
        Rate sigma of an exponential window e^(-sigma t) of force and response, 0 for none [1/s].
    modes
        Modes that the responses show.
    fit
        The fit that they are of; None if there is none.
    suspicions
        What looks wrong in the record, in words.
    remarks
        How the record is read and what it leaves open, in words.
    """

    type: ClassVar[str] = "frequency response"
    name: str
    test: int
    configuration: str
    sensors: tuple[str, ...]
    frequency: Frequencies
    value: Complex[NDArray[np.complex128], "c f"]
    units: tuple[str, ...]
    coherence: Float[NDArray[np.float64], "c f"]
    level: float | None
    repeat: int
    coherence_limit: float = LEAST_COHERENCE
    held_out: bool = False
    window: Window = Window.UNKNOWN
    decay: float = 0.0
    modes: tuple[MeasuredMode, ...] = ()
    fit: Modes | None = None
    suspicions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "frequency", "coherence")
        freeze_fields(self, "value", kind=np.complex128)

    @property
    def coherent_lines(self) -> NDArray[np.bool_]:
        """Lines at which all sensors have a value, and one of them a coherent one, shape (f,).

        None has one where the force is negligible; at an antiresonance of one sensor the other sensors have one.
        """
        coherent = (self.coherence >= self.coherence_limit).any(axis=0)
        return np.asarray(np.isfinite(self.value).all(axis=0) & coherent)
