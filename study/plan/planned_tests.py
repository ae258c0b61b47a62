"""Planned tests of a case, from options of the user; values without an option come from the case."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from casefile.quantity import FREQUENCY, RATIO, read_quantity
from correlation.model import LineSensor, LoadCell, Model, Sensor
from diagnosis.candidate.resonance import find_resonance
from diagnosis.next_test.list_tests import surround_resonance
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.planned_noise import NoiseLaw, PlannedNoise
from geometry.errors import InputError
from study.case.setup import ReadCase

#: Directions of sweeps by the value of the option.
SWEEPS = {"up": (1,), "down": (-1,), "both": (1, -1)}
#: Noise floor of a sensor over its relative noise, as a fraction of its largest reading at the lowest level [-].
FLOOR = 0.2
#: Largest number of frequencies of a curve, and of repeats.
MAX_FREQUENCIES = 500


@dataclass(frozen=True, kw_only=True)
class PlanRequest:
    """Requested tests; for a band of None, or for no levels or sensors, the values come from the case.

    Parameters
    ----------
    levels
        Levels; each scales the loads of the case.
    first, last
        Ends of the band, such as "430 Hz".
    n_frequency, n_repeat
        Numbers of frequencies of a curve and of repeats [-].
    sweep
        Key of `SWEEPS`.
    harmonics
        Measured harmonics.
    noise
        Relative standard deviation of each part of a reading, such as "0.5 %".
    sensors
        Names of sensors or places of the case.
    free
        Whether the structure without its contacts is tested as well.
    """

    levels: tuple[float, ...] = ()
    first: str | None = None
    last: str | None = None
    n_frequency: int = 24
    n_repeat: int = 3
    sweep: str = "both"
    harmonics: tuple[int, ...] = (1,)
    noise: str = "0.5 %"
    sensors: tuple[str, ...] = ()
    free: bool = False


def choose_sensors(read: ReadCase, names: Sequence[str]) -> Model:
    """Model of a case with only the planned sensors; by default the sensors of the case.

    Raises
    ------
    InputError
        If a name is neither a sensor nor a place, or no sensor reads a motion.
    """
    model = read.model
    own = {item.name: item for item in model.sensors}
    chosen: list[Sensor | LineSensor | LoadCell] = []
    for name in names or tuple(own):
        if name in own:
            chosen.append(own[name])
        elif name in model.places:
            chosen.append(Sensor(name=name, row=model.places[name]))
        else:
            known = ", ".join(dict.fromkeys([*own, *model.places]))
            raise InputError(f'--sensors: "{name}" is not a sensor or place of the case: give any of {known or "none"}')
    if not any(isinstance(item, Sensor) for item in chosen):
        raise InputError("--sensors: none reads a motion: add a [[sensor]] to the case, or name places with --sensors")
    return Model(**{**vars(model), "sensors": tuple(chosen)})


def make_tests(read: ReadCase, model: Model, request: PlanRequest) -> list[NextTest]:
    """Planned tests of the jointed structure and, if requested, of the structure without its contacts.

    Raises
    ------
    InputError
        If a value is out of range, neither the options nor the case give a band, or a test without contacts is
        requested for a structure without contact lines or without a resonance.
    """
    levels, (first, last) = _choose_levels(read, request), _choose_band(read, request)
    for option, value, least in (("frequencies", request.n_frequency, 2), ("repeats", request.n_repeat, 1)):
        if not least <= value <= MAX_FREQUENCIES:
            raise InputError(f"--{option} {value}: give a number from {least} to {MAX_FREQUENCIES}")
    for harmonic in request.harmonics:
        if not 1 <= harmonic < model.n_harmonic:
            raise InputError(
                f"--harmonics {harmonic}: the model keeps 1 to {model.n_harmonic - 1}: give one of these, or raise "
                "harmonics.highest in the case"
            )
    jointed = NextTest(
        name="planned", configuration="jointed", levels=levels,
        frequencies=tuple(np.linspace(first, last, request.n_frequency).tolist()),
        sensors=tuple(item.name for item in model.sensors), harmonics=request.harmonics, sweeps=SWEEPS[request.sweep],
        n_repeat=request.n_repeat,
    )  # fmt: skip
    return [jointed, _make_free(jointed, model)] if request.free else [jointed]


def make_noise(text: str, model: Model, largest: dict[str, float]) -> PlannedNoise:
    """Noise of all sensors: a relative part, and a floor of `FLOOR` times that part of the largest reading.

    Parameters
    ----------
    text
        Relative noise of each part of a reading, such as "0.5 %".
    model
        Model with the planned sensors.
    largest
        Largest reading of each sensor at the lowest level, by name.
    """
    relative = _read(text, RATIO, "noise")
    if not relative > 0:
        raise InputError(f'--noise "{text}" is not positive: give the noise of a reading, such as "0.5 %"')
    laws = {item.name: NoiseLaw(relative, FLOOR * relative * largest.get(item.name, 0.0)) for item in model.sensors}
    known = {(name, harmonic): law for name, law in laws.items() for harmonic in range(model.n_harmonic)}
    return PlannedNoise(usual=next(iter(laws.values())), known=known)


def _choose_levels(read: ReadCase, request: PlanRequest) -> tuple[float, ...]:
    sweep = read.opened.case.sweep
    levels = request.levels or tuple(getattr(sweep, "levels", ())) or (1.0,)
    for level in levels:
        if not (np.isfinite(level) and level > 0):
            raise InputError(f"--levels {level:g}: a level scales the loads of the case: give a positive number")
    return tuple(sorted({float(level) for level in levels}))


def _choose_band(read: ReadCase, request: PlanRequest) -> tuple[float, float]:
    sweep = read.opened.case.sweep
    over_frequency = sweep is not None and sweep.parameter == "frequency"
    ends = []
    for option, text, key in (("from", request.first, "first"), ("to", request.last, "last")):
        if text is not None:
            ends.append(_read(text, FREQUENCY, option))
        elif over_frequency:
            ends.append(float(getattr(sweep, key)))
        else:
            raise InputError(
                f'--{option} is missing, and the case has no [sweep] over frequency: give --{option} "100 Hz"'
            )
    low, high = sorted(ends)
    if not 0 < low < high:
        raise InputError(f"--from {low:g} Hz, --to {high:g} Hz: give two different positive frequencies")
    return low, high


def _make_free(jointed: NextTest, model: Model) -> NextTest:
    resonance = find_resonance(model.without_contacts().system, jointed.levels[0]) if model.lines else None
    band = None if resonance is None else surround_resonance(resonance, resonance.number)
    if band is None:
        raise InputError(
            "--free: the structure has no contact line to open, or no resonance without it: leave --free out"
        )
    motions = tuple(item.name for item in model.sensors if isinstance(item, Sensor))
    return NextTest(
        name="planned, without contacts", configuration="free", levels=jointed.levels[:2], frequencies=band,
        sensors=motions, harmonics=jointed.harmonics, sweeps=jointed.sweeps, n_repeat=jointed.n_repeat,
    )  # fmt: skip


def _read(text: str, dimension: object, option: str) -> float:
    try:
        return read_quantity(text, dimension)  # type: ignore[arg-type]
    except ValueError as error:
        raise InputError(f'--{option} "{text}": {error}') from None
