"""A possible next test: its set-up, its readings, and its duration."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.prediction import Points
from diagnosis.candidate.place import find_translations, is_parallel

#: Time to prepare a test, and to measure one steady state [min]; they order tests of equal separation.
PREPARATION: Mapping[str, float] = {"sensor": 10.0, "mass": 10.0, "preload": 30.0, "free": 60.0}
STATE = 10 / 60
#: Prefix of the name of a further sensor, before its place.
FURTHER = "further sensor at "


class SetUp(NamedTuple):
    """Set-up of the structure in a test; tests of one set-up share their steady states."""

    configuration: str
    sweeps: tuple[int, ...]
    added_mass: tuple[str, float] | None
    preload: float


@dataclass(frozen=True, kw_only=True)
class NextTest:
    """A test.

    Parameters
    ----------
    name
        Difference from previous tests, in words.
    configuration
        "jointed" or "free".
    levels, frequencies
        Levels [N, or the unit of the drive] and frequencies [Hz] of its steady states.
    sensors
        Names of the sensors of the campaign that are read.
    place
        Place of a further motion sensor, if there is one.
    harmonics
        Harmonics at which motions are read.
    sweeps
        Sweep directions, +1 up, -1 down; empty for stepped steady states.
    n_repeat
        Number of repeats [-].
    added_mass
        Place and size of an added mass [kg].
    preload
        Factor on all preloads [-].
    is_held_out
        Whether its data test a fit, to confirm an effect, instead of being fitted.
    """

    name: str
    configuration: str
    levels: tuple[float, ...]
    frequencies: tuple[float, ...]
    sensors: tuple[str, ...]
    place: str | None = None
    harmonics: tuple[int, ...] = (1,)
    sweeps: tuple[int, ...] = ()
    n_repeat: int = 2
    added_mass: tuple[str, float] | None = None
    preload: float = 1.0
    is_held_out: bool = False

    @property
    def set_up(self) -> SetUp:
        """Set-up of the structure."""
        return SetUp(self.configuration, self.sweeps, self.added_mass, self.preload)

    @property
    def fits_campaign(self) -> bool:
        """Whether its data can be added to the same campaign: not with another mass or preload."""
        return self.added_mass is None and self.preload == 1.0

    @property
    def minutes(self) -> float:
        """Duration of the test [min]."""
        prepared = {
            "sensor": self.place is not None, "mass": self.added_mass is not None, "preload": self.preload != 1.0,
            "free": self.configuration == "free",
        }  # fmt: skip
        n_state = len(self.levels) * len(self.frequencies) * max(len(self.sweeps), 1) * self.n_repeat
        return sum(PREPARATION[name] for name, is_done in prepared.items() if is_done) + STATE * n_state

    @property
    def title(self) -> str:
        """Differences from previous tests, including a further sensor, in words."""
        return self.name if self.place is None else f"{self.name}, and a further sensor at {self.place}"

    def make_points(self) -> Points:
        """Points of its readings."""
        names = [*self.sensors, *([] if self.place is None else [f"{FURTHER}{self.place}"])]
        level, frequency, sensor, harmonic = (
            item.ravel()
            for item in np.meshgrid(self.levels, self.frequencies, np.arange(len(names)), self.harmonics, indexing="ij")
        )
        return Points(
            free=np.full(len(level), self.configuration == "free"), level=level, frequency=frequency,
            sensor=np.array(names)[sensor.astype(int)], harmonic=harmonic.astype(np.int64),
        )  # fmt: skip


def apply_set_up(set_up: SetUp, model: Model) -> Model:
    """The model with the set-up of a test."""
    if set_up.added_mass is not None:
        place, mass = set_up.added_mass
        rows = find_mass_rows(model, place)
        model = model.with_system(mass=model.system.mass + mass * rows.T @ rows)
    if set_up.preload != 1.0:
        for name in model.preloads:
            model = model.with_preload_ratio(name, set_up.preload)
    return model


def find_mass_rows(model: Model, place: str) -> Float[NDArray[np.float64], "t r"]:
    """Rows along which a mass at a place moves, shape (t, r): all translations of its node, if that is known."""
    row = model.places[place]
    moved = find_translations(model, row)
    return np.eye(len(row))[list(moved)] if moved else row[None]


def list_free_places(model: Model, sensors: tuple[str, ...]) -> list[str]:
    """Places that none of some sensors measures, without duplicates."""
    rows = [row for item in model.sensors if item.name in sensors and (row := getattr(item, "row", None)) is not None]
    result = []
    for name, row in model.places.items():
        if row.any() and not any(is_parallel(row, other) for other in rows):
            result.append(name)
            rows.append(row)
    return result
