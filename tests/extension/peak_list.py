"""A type of data from outside: the peak of a response curve at one level, as a report states it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.mode import compute_linear_modes
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Features
from correlation.model import Model


@dataclass(frozen=True, kw_only=True)
class Peak:
    type: ClassVar[str] = "peak"
    name: str
    frequency: float
    held_out: bool = False


def read(table: TomlTable, context: DataContext) -> Peak:
    peak = Peak(
        name=table.take("name", str),
        frequency=table.converted("frequency", lambda value: read_si_quantity(value, "Hz"), example="50 Hz"),
    )
    table.finish()
    return peak


def features(peak: Peak) -> Features:
    value = np.array([peak.frequency])
    return Features(label=("frequency",), unit=("Hz",), value=value, deviation=1e-3 * value)


def predict(model: Model, peak: Peak) -> np.ndarray:
    frequency = compute_linear_modes(model, "jointed")[0]
    return frequency[[np.argmin(np.abs(frequency - peak.frequency))]]


DATA_TYPES.register(
    DataType(
        name="peak", table="peak", holds="peaks of response curves", read=read, features=features, predict=predict,
        states=None, panels=None,
    )
)  # fmt: skip
