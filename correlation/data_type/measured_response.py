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
        Name in the manifest.
    test
        Index of its test in the campaign; -1 without a test.
    configuration
        "jointed", or "free" of all contacts.
    sensors
        Names of the sensors.
    frequency
        Rising frequencies, shape (f,) [Hz].
    value
        Response per unit of the drive, e^{+i Omega t}, shape (c, f) [unit of each sensor per unit of the drive]; NaN
        where a sensor has no value.
    units
        Unit of each row of `value`, in words.
    coherence
        Coherence, shape (c, f) [-]; 1 if it is not known.
    coherence_limit
        Smallest coherence of a value that is not mainly noise [-].
    level
        Amplitude of the drive [unit of the drive]; None if it is not stated.
    repeat
        Number of the repeat.
    held_out
        Whether it is held out of calibrations.
    window
        Window of the estimation.
    decay
        Rate sigma of an exponential window e^(-sigma t) of force and response [1/s]; 0 without one.
    modes
        Modes of the responses.
    fit
        Fit of the modes; None if there is none.
    suspicions
        Suspicions about the record, in words.
    remarks
        Remarks on how the record is read and what it leaves open, in words.
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
        """Mask of the lines at which all sensors have a value, at least one of them coherent, shape (f,).

        If the force is negligible, no sensor is coherent; at an antiresonance of one sensor, the other sensors are.
        """
        coherent = (self.coherence >= self.coherence_limit).any(axis=0)
        return np.asarray(np.isfinite(self.value).all(axis=0) & coherent)
