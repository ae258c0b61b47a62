"""Registry of types of measured data: their reader, their features, and the prediction of the features by a model.

A loop, a ring-down or a set of modes is compared with a model by a few features, such as work per cycle or the
frequency at an amplitude. Each type computes them with unit and standard deviation, and their prediction.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.measurement import MeasuredSensor, Measurement, Test
from correlation.campaign.run_table import RunUnits
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.indication import ListIndications
from correlation.model import Model
from geometry.registry import Registry

#: Row of a model, shape (n,), and its largest displacement [m].
Motion = tuple[Float[NDArray[np.float64], " n"], float]
Curve = tuple[Float[NDArray[np.float64], " n"], Float[NDArray[np.float64], " n"]]


class Datum(Protocol):
    """Measured data of one type."""

    @property
    def type(self) -> str:
        """Name of its type in `DATA_TYPES`."""

    @property
    def name(self) -> str:
        """Name in the manifest."""

    @property
    def held_out(self) -> bool:
        """Whether it is held out of calibrations."""


#: Calls a function of a module with its arguments, or returns an earlier result for the same arguments.
Analyse: TypeAlias = Callable[..., Any]


def analyse_uncached(compute: Callable[..., Any], *args: Any, **words: Any) -> Any:
    """Call a function with its arguments without keeping the result."""
    return compute(*args, **words)


@dataclass(frozen=True, kw_only=True, eq=False)
class DataContext:
    """Context for reading an entry of a manifest.

    Parameters
    ----------
    files
        Files of the campaign.
    sensors, tests
        Sensors and tests of the manifest.
    units
        Units and conventions of the manifest.
    analyse
        Calls a slow function of a module with its arguments, or returns an earlier result for the same arguments.
    """

    files: MeasuredFiles
    sensors: Sequence[MeasuredSensor]
    tests: Sequence[Test]
    units: RunUnits
    analyse: Analyse


@dataclass(frozen=True, kw_only=True, eq=False)
class Features:
    """Features of data: numbers for the comparison with a model.

    Parameters
    ----------
    label
        Names of the m features, such as "work per cycle".
    unit
        SI units of the features.
    value, deviation
        Measured values and their standard deviations, shape (m,) [unit of the feature].
    """

    label: tuple[str, ...]
    unit: tuple[str, ...]
    value: Float[NDArray[np.float64], " m"]
    deviation: Float[NDArray[np.float64], " m"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """Axes of a figure that compares a datum with a model.

    Parameters
    ----------
    title, x_label, y_label
        Title and labels with units.
    measured, predicted
        Curves as pairs of x and y, shape (n,) each.
    is_curve
        Whether the measured values are drawn as a line; points otherwise.
    log_x, log_y
        Whether the axes are logarithmic.
    """

    title: str
    x_label: str
    y_label: str
    measured: tuple[Curve, ...]
    predicted: tuple[Curve, ...]
    is_curve: bool = False
    log_x: bool = False
    log_y: bool = False


@dataclass(frozen=True, kw_only=True)
class DataType:
    """Type of measured data.

    Parameters
    ----------
    name
        Name of the type, such as "force-displacement loop".
    table
        Name of its tables in a manifest, such as "loop".
    holds
        Description of the data that a user gives, in words.
    read
        Reads an entry of a manifest; raises `CampaignError` in one sentence.
    features
        Computes the features of a datum.
    predict
        Predicts the features of a datum by a model, shape (m,); NaN if the model has no solution. Raises
        `CampaignError` if the model lacks a place, line or sensor of the datum.
    states
        Converts a datum to steady states, given the names of all sensors of the campaign; None for a type without
        steady states.
    panels
        Makes the panels that compare a datum with a model; None for a type without panels.
    indications
        Lists the indications of all data of the type beside a model; None for a type without indications.
    motions
        Lists rows of a model whose motion was measured, with the largest displacement of each [m]; None for a type
        whose data have no amplitude.
    coverage
        Describes which part of a datum its features use and which is left out, in words; None for a type that uses all.
    check
        Like `read` without slow analyses, to check whether an entry can be read; None if `read` is fast.
    """

    name: str
    table: str
    holds: str
    read: Callable[[TomlTable, DataContext], Any]
    features: Callable[[Any], Features]
    predict: Callable[[Model, Any], Float[NDArray[np.float64], " m"]]
    states: Callable[[Any, Sequence[str]], Measurement | None] | None
    panels: Callable[[Model, Any], Sequence[Panel]] | None
    indications: ListIndications | None = None
    motions: Callable[[Model, Any], Sequence[Motion]] | None = None
    coverage: Callable[[Any], str] | None = None
    check: Callable[[TomlTable, DataContext], Any] | None = None


def _wrong(type_: DataType) -> str | None:
    for fact in ("table", "holds"):
        text = getattr(type_, fact)
        if not (isinstance(text, str) and text.strip()):
            return f"has {fact} = {text!r}: give text"
    if type_.table in {"sensor", "test", "run", "record", "load_cells", "units", "convention", "held_out", "drive"}:
        return f'has table = "{type_.table}", which a manifest uses for something else: take another name'
    for fact in ("read", "features", "predict"):
        if not callable(getattr(type_, fact)):
            return f"has {fact} = {getattr(type_, fact)!r}: give a function"
    return None


DATA_TYPES: Registry[DataType] = Registry(
    "data type",
    package="correlation.data_type",
    group="stickslip.data_types",
    facts={
        "table": "the name of its tables in a manifest",
        "holds": "what a user gives, in words",
        "read": "a function of a table of a manifest and a DataContext",
        "features": "a function of what was read",
        "predict": "a function of a model and of what was read",
        "states": "a function of what was read and the names of all sensors, or None",
        "panels": "a function of a model and of what was read, or None",
    },
    check=_wrong,
)
