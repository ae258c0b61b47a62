r"""Data classes of a measured campaign: stepped-sine responses as one tidy table, in SI and in one convention.

A steady state is :math:`x(t) = \operatorname{Re} \sum_k X_k e^{i k \Omega t}` under the force
:math:`F \cos \Omega t`: peak amplitudes, :math:`X_0` the mean, the level :math:`F` real.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.row_table import RowTable
from geometry.read_only_array import freeze_fields

IntColumn = Int[NDArray[np.int64], " k"]
FloatColumn = Float[NDArray[np.float64], " k"]
ComplexColumn = Complex[NDArray[np.complex128], " k"]
Mask = Bool[NDArray[np.bool_], " k"]

CONTACT_FORCE = "contact force"
#: Quantity of a sensor behind a contact line; pairs are converted to contact forces when a campaign is read.
LOAD_CELL = "load cell"
#: Relative difference below which two frequencies are the same: counters and files round.
SAME_FREQUENCY = 1e-5
#: SI unit by the quantity of a sensor.
SI_UNIT = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", CONTACT_FORCE: "N", LOAD_CELL: "N"}
#: SI unit by the quantity of a sensor of a rotation.
ROTATION_UNIT = {"displacement": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}
COMPONENTS = ("tangential", "normal")
CONFIGURATIONS = ("jointed", "free")
#: Quantity that is held constant while the frequency changes.
CONTROLS = ("force", "response")
#: Default of the forces of a `Measurement`: not measured.
NOT_MEASURED = np.zeros(0)
#: Name of a sweep by its number in the table.
SWEEPS = {1: "up", -1: "down", 0: "none"}


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredSensor:
    """Sensor of a measured channel, and its position.

    Parameters
    ----------
    name
        Name in the tables.
    quantity
        "displacement", "velocity", "acceleration", "contact force" or "load cell".
    direction
        "x", "y", "z", "rx", "ry", "rz"; empty for a contact force or load cell, and if the sensor of the model
        defines it.
    place
        Named place of the model, if the position is given by name.
    coordinates
        Coordinates of the point, shape (3,) [m], if the position is given by coordinates.
    cell
        Load cell of the model with which it is compared; None for a load cell that is converted to contact forces.
    line, component
        Contact line of a contact force, and "tangential" or "normal".
    uncertainty
        Relative systematic standard uncertainty of its gain [-]; 0 if not given.
    has_phase
        Whether its values are complex; if not, they are amplitudes, real and positive.
    calibrated
        Whether its values are in the SI unit of its quantity; if not, they have one unknown real factor.
    reading_unit
        Unit of the values of a sensor that is not calibrated, such as "V"; only a label.
    noise
        Standard deviation of one reading as stated by the test engineer: relative [-] and absolute [SI unit]; zeros if
        it is to be estimated from the data.
    relative_to
        Named place of the model whose motion is subtracted, for a sensor between two bodies; None for a sensor of the
        motion of its place alone.
    inclination
        Angle between the sensor's axis and its direction [rad]: it reads cos(inclination) of the motion along
        `direction` and sin(inclination) of that along `toward`.
    toward
        Direction in which the axis leans, "x", "y" or "z"; empty without inclination.
    """

    name: str
    quantity: str
    direction: str = ""
    place: str | None = None
    coordinates: Float[NDArray[np.float64], "3"] | None = None
    line: str | None = None
    component: str | None = None
    uncertainty: float = 0.0
    has_phase: bool = True
    calibrated: bool = True
    reading_unit: str = ""
    noise: tuple[float, float] = (0.0, 0.0)
    relative_to: str | None = None
    inclination: float = 0.0
    toward: str = ""
    cell: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", tuple(self.noise))
        if self.coordinates is not None:
            freeze_fields(self, "coordinates")

    @property
    def unit(self) -> str:
        """Unit of its values: SI, or the label of an uncalibrated sensor."""
        if not self.calibrated:
            return self.reading_unit
        rotates = self.direction in {"rx", "ry", "rz"}
        return ROTATION_UNIT[self.quantity] if rotates else SI_UNIT[self.quantity]


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Quantity and unit of the excitation levels of a campaign.

    Parameters
    ----------
    quantity
        "force" at the loads of the case, or "base acceleration" of its supports.
    unit
        Unit of the levels: "N" or "m/s^2"; the unit in the files, such as "V", if the drive is not calibrated.
    calibrated
        Whether levels are in SI; if not, they have one unknown real factor.
    """

    quantity: str = "force"
    unit: str = "N"
    calibrated: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Test:
    """A series of measurements in one configuration.

    Parameters
    ----------
    name
        Name in the tables.
    configuration
        "jointed", or "free" of all contacts.
    settling
        Whether its repeats are readings of a response that still settles, such as a joint that runs in; their scatter
        is then not taken as noise.
    control
        "force", or "response" for a test at a constant response, whose force differs from point to point.
    """

    __test__ = False  # keeps pytest from collecting it

    name: str
    configuration: str = "jointed"
    settling: bool = False
    control: str = "force"


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement(RowTable):
    """Complex amplitudes, one per row; sorted by test, level, frequency, sensor, harmonic, sweep, repeat when read.

    Parameters
    ----------
    test, sensor
        Indices into the campaign's tests and sensors, shape (k,).
    order
        Number in the order of measurement, shape (k,).
    repeat
        Number of the repeat, shape (k,).
    sweep
        +1 up, -1 down, 0 none, shape (k,).
    level
        Set point of the amplitude of the force, shape (k,) [N]: rows of one level belong together.
    frequency
        Frequency of the force, shape (k,) [Hz].
    harmonic
        k of the value; 0 is the mean, shape (k,).
    value
        X_k, peak amplitude, shape (k,) [SI unit of the sensor].
    force
        Measured amplitude of the force, shape (k,) [N]; the level by default.
    """

    test: IntColumn
    order: IntColumn
    repeat: IntColumn
    sweep: IntColumn
    level: FloatColumn
    frequency: FloatColumn
    sensor: IntColumn
    harmonic: IntColumn
    value: ComplexColumn
    force: FloatColumn = field(default_factory=lambda: NOT_MEASURED)

    def __post_init__(self) -> None:
        if self.force is NOT_MEASURED:
            object.__setattr__(self, "force", self.level)
        freeze_fields(self, "test", "order", "repeat", "sweep", "sensor", "harmonic", kind=np.int64)
        freeze_fields(self, "level", "frequency", "force")
        freeze_fields(self, "value", kind=np.complex128)


@dataclass(frozen=True, kw_only=True, eq=False)
class HeldOut:
    """Data that no calibration uses: whole levels [N] and whole repeats."""

    levels: tuple[float, ...] = ()
    repeats: tuple[int, ...] = ()

    def rows(self, measurement: Measurement) -> Mask:
        """Rows of a held-out level or of a held-out repeat, shape (k,)."""
        held = np.isin(measurement.repeat, self.repeats)
        for level in self.levels:
            held |= match_level(measurement.level, level)
        return held


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """Probable mistake in the data that is not certain, or a remark on them.

    Parameters
    ----------
    where
        File, test or sensor.
    sentence
        Suspected mistake, with the evidence in numbers and the remedy.
    of_test
        Whether it affects all readings of a test, so that single channels of the test cannot be judged by a model.
    remark
        Whether it only states how the data are read or what they leave open, and not that they may be wrong.
    headline
        Words for the headline of a verdict that cannot be read without the suspicion; empty for `where`, or for nothing
        if it is a remark.
    alike
        Other places with the same suspicion.
    of_time
        Whether the structure may have changed during a test, so that no case explains all of it; with a headline.
    """

    where: str
    sentence: str
    of_test: bool = False
    remark: bool = False
    headline: str = ""
    alike: tuple[str, ...] = ()
    of_time: bool = False

    def lies_in(self, where: str) -> bool:
        """Whether its place is the given place or a part of it, such as a repeat of a test."""
        return f"{self.where},".startswith(f"{where},")

    def __str__(self) -> str:
        """``where: sentence``."""
        return f"{self.where}: {self.sentence}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """All measured data of one structure.

    Parameters
    ----------
    title, folder
        Title, and folder of its files.
    sensors, tests
        Sensors and tests, in the order of the indices of the table.
    measurement
        Table of steady states; frequencies that differ only by rounding are made equal.
    held_out
        Levels and repeats that are held out of calibrations.
    records
        Time records.
    suspicions
        Suspected mistakes in the data.
    drive
        Quantity and unit of the levels.
    data
        Data of other types, such as loops; each names its type in `correlation.data_type.registry.DATA_TYPES`.
    level_factor
        Factor from the unit of levels in the manifest to the levels of the table [N].
    """

    title: str
    folder: Path
    sensors: tuple[MeasuredSensor, ...]
    tests: tuple[Test, ...]
    measurement: Measurement
    held_out: HeldOut
    records: tuple[TimeRecord, ...] = ()
    suspicions: tuple[Suspicion, ...] = ()
    drive: Drive = Drive()
    data: tuple[Any, ...] = ()
    level_factor: float = 1.0

    def __post_init__(self) -> None:
        table = self.measurement
        aligned = _align_frequencies(table.frequency)
        if not np.array_equal(aligned, table.frequency):
            object.__setattr__(self, "measurement", replace(table, frequency=aligned))

    @property
    def levels(self) -> Float[NDArray[np.float64], " l"]:
        """Measured levels in rising order, shape (l,) [N]."""
        return np.unique(self.measurement.level)

    @property
    def structure_sensors(self) -> list[int]:
        """Indices of all sensors except those of contact forces."""
        return [number for number, item in enumerate(self.sensors) if item.quantity != CONTACT_FORCE]

    @property
    def is_free(self) -> Mask:
        """Mask of the tests of the structure without its contacts, shape (t,)."""
        return np.array([test.configuration == "free" for test in self.tests], dtype=bool)

    @property
    def has_only_typed_data(self) -> bool:
        """Whether there are typed data and no steady states."""
        return bool(self.data) and not len(self.measurement)

    @property
    def content(self) -> dict[str, Any]:
        """Values of all fields except the folder."""
        return {name: value for name, value in vars(self).items() if name != "folder"}

    def suspected(self, more: Iterable[Suspicion]) -> "Campaign":
        """Copy of the campaign with further suspicions."""
        return replace(self, suspicions=(*self.suspicions, *more))


def advise_held_out(measurement: Measurement, level_factor: float) -> str:
    """Advice on data to hold out, such as "levels = [3]"; empty if there is only one repeat of one level.

    The last repeat tests a fit at all levels; the second highest level lies between others.

    Parameters
    ----------
    measurement
        All measurements.
    level_factor
        As in `Campaign`.
    """
    repeats, levels = np.unique(measurement.repeat), np.unique(measurement.level) / level_factor
    if len(repeats) > 1:
        return f"repeats = [{repeats[-1]}]"
    return f"levels = [{levels[-2] if len(levels) > 2 else levels[-1]:g}]" if len(levels) > 1 else ""


def name_configuration(free: bool) -> str:
    """Name of the configuration without contacts, or with them."""
    return "free" if free else "jointed"


def number_frequencies(frequency: FloatColumn) -> IntColumn:
    """Number of each frequency, equal for frequencies that differ only by rounding, shape (k,).

    A new number begins at each gap of the sorted frequencies: rounding them would separate neighbours.
    """
    rising, place = np.unique(frequency, return_inverse=True)
    return np.asarray(np.cumsum(np.diff(rising, prepend=rising[:1]) > SAME_FREQUENCY * rising)[place])


def _align_frequencies(frequency: FloatColumn) -> FloatColumn:
    """Frequencies with those that differ only by rounding set to the lowest of them, shape (k,)."""
    number = number_frequencies(frequency)
    least = np.full(len(frequency), np.inf)
    np.minimum.at(least, number, frequency)
    return least[number]


def match_level(level: FloatColumn, wanted: float) -> Mask:
    """Mask of the rows of one level, shape (k,): levels are set points, equal except for the rounding of their unit."""
    return np.isclose(level, wanted, rtol=1e-9, atol=0.0)
