r"""A measured campaign: stepped-sine responses as one tidy table, in SI and in one convention.

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
#: A force behind a contact line, which becomes its contact forces when a campaign is read.
LOAD_CELL = "load cell"
#: Frequencies that differ by less than this share are one: counters and files round.
SAME_FREQUENCY = 1e-5
#: What a sensor can measure, with its SI unit.
SI_UNIT = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", CONTACT_FORCE: "N", LOAD_CELL: "N"}
#: The same for rotations.
ROTATION_UNIT = {"displacement": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}
COMPONENTS = ("tangential", "normal")
CONFIGURATIONS = ("jointed", "free")
#: What is held constant while the frequency changes.
CONTROLS = ("force", "response")
#: Stands for forces that were not measured.
NOT_MEASURED = np.zeros(0)
#: Words of a sweep, by the number in the table.
SWEEPS = {1: "up", -1: "down", 0: "none"}


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredSensor:
    """Sensor of a measured channel, and its position.

    Parameters
    ----------
    name
        As in the tables.
    quantity
        "displacement", "velocity", "acceleration" or "contact force".
    direction
        "x", "y", "z", "rx", "ry", "rz"; empty for a contact force, and where it is left to the model's sensor.
    place
        Named place of the model, if it is given by name.
    coordinates
        Coordinates of the point, shape (3,) [m], if it is given by them.
    cell
        Load cell of the model, for one that is compared itself; None for one that becomes contact forces.
    line, component
        Contact line of a contact force, and "tangential" or "normal".
    uncertainty
        Relative systematic standard uncertainty of its gain [-]; 0 if none is given.
    has_phase
        Whether its values are complex; without, they are amplitudes, real and positive.
    calibrated
        Whether its values are in the SI unit of its quantity; without, they are up to one unknown real factor.
    reading_unit
        Unit of the values of a sensor that is not calibrated, such as "V"; no more than a label.
    noise
        Standard deviation of one reading that the test engineer states: relative [-] and absolute [SI unit]; zeros
        leave it to the data.
    relative_to
        Named place of the model whose motion is subtracted, for a sensor between two bodies; None for one that
        reads the motion of its place alone.
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
        """Unit of its values: SI, or what an uncalibrated one is labelled with."""
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
        Unit of the levels: "N" or "m/s^2"; as the files say, such as "V", if it is not calibrated.
    calibrated
        Whether levels are in SI; without, they are up to one unknown real factor.
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
        As in the tables.
    configuration
        "jointed", or "free" of all contacts.
    settling
        Whether its repeats are readings of a response that still settles, such as a joint that runs in: they are no
        repeats, and their scatter is no noise.
    control
        "force", or "response" for a test at a constant response, whose force differs from point to point.
    """

    __test__ = False  # no test of pytest's

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
        Place in the order in which the runs were made, shape (k,).
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
        Amplitude of the force as it was, shape (k,) [N]; the level by default.
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
    """Something that can be right, but hardly is.

    Parameters
    ----------
    where
        File, test or sensor.
    sentence
        Suspected mistake, with the evidence in numbers and the remedy.
    of_test
        Whether it spoils all readings of a test, so that a model says nothing about single channels beside it.
    remark
        Whether it says how the data are read or what they leave open, and not that they may be wrong.
    headline
        What a headline says of it where the verdict cannot be read without it; empty for its place, or nothing for a
        remark.
    alike
        Other places where the same is suspected.
    of_time
        Whether what was measured may have changed during a test, so that no case explains all of it; with a headline.
    """

    where: str
    sentence: str
    of_test: bool = False
    remark: bool = False
    headline: str = ""
    alike: tuple[str, ...] = ()
    of_time: bool = False

    def lies_in(self, where: str) -> bool:
        """Whether its place is a place, or a part of it: a test, and a repeat of that test."""
        return f"{self.where},".startswith(f"{where},")

    def __str__(self) -> str:
        """``where: sentence``."""
        return f"{self.where}: {self.sentence}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """All that was measured on one structure.

    Parameters
    ----------
    title, folder
        Title, and folder of its files.
    sensors, tests
        Sensors and tests, in the order of the indices of the table.
    measurement
        The table; frequencies that are the same but for rounding are made equal in it.
    held_out
        Levels and repeats that no calibration may see.
    records
        Time records.
    suspicions
        Suspected mistakes in the data.
    drive
        What the levels are.
    data
        Data of other types, such as loops; each names its type in `correlation.data_type.registry.DATA_TYPES`.
    level_factor
        Level of one unit that its manifest gives levels in [N].
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
        """Levels that were measured, rising, shape (l,) [N]."""
        return np.unique(self.measurement.level)

    @property
    def structure_sensors(self) -> list[int]:
        """Numbers of the sensors of the structure itself: all but those of contact forces."""
        return [number for number, item in enumerate(self.sensors) if item.quantity != CONTACT_FORCE]

    @property
    def is_free(self) -> Mask:
        """Whether each test is of the structure without its contacts, shape (t,)."""
        return np.array([test.configuration == "free" for test in self.tests], dtype=bool)

    @property
    def has_only_typed_data(self) -> bool:
        """Whether there are typed data and no steady states."""
        return bool(self.data) and not len(self.measurement)

    @property
    def content(self) -> dict[str, Any]:
        """Content by field, independent of the place of the files."""
        return {name: value for name, value in vars(self).items() if name != "folder"}

    def suspected(self, more: Iterable[Suspicion]) -> "Campaign":
        """The same campaign with further suspicions."""
        return replace(self, suspicions=(*self.suspicions, *more))


def advise_held_out(measurement: Measurement, level_factor: float) -> str:
    """What a manifest may hold out of some measurements, such as "levels = [3]"; empty if they are of one run.

    The last repeat tests a fit at all levels; the highest level but one lies between others.

    Parameters
    ----------
    measurement
        All that was measured.
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
    """Numbers of the frequencies, alike for those that are one; by gaps, since rounding would part neighbours."""
    rising, place = np.unique(frequency, return_inverse=True)
    return np.asarray(np.cumsum(np.diff(rising, prepend=rising[:1]) > SAME_FREQUENCY * rising)[place])


def _align_frequencies(frequency: FloatColumn) -> FloatColumn:
    """Frequencies that are the same but for rounding made equal, to the least of them."""
    number = number_frequencies(frequency)
    least = np.full(len(frequency), np.inf)
    np.minimum.at(least, number, frequency)
    return least[number]


def match_level(level: FloatColumn, wanted: float) -> Mask:
    """Rows of one level, shape (k,): levels are set points, equal but for the rounding of their unit."""
    return np.isclose(level, wanted, rtol=1e-9, atol=0.0)
