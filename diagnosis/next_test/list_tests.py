"""Possible next tests, from a campaign and its best model."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.model import Model, Sensor
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.place import MOVES
from diagnosis.candidate.resonance import DRIVEN, SHIFT, ResonanceModel, find_resonance
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.next_test.next_test import NextTest, find_mass_rows, list_free_places

#: Name of a repetition of the tests.
AGAIN = "the same tests again"
#: Number of frequencies of a curve, and of repeats [-].
N_FREQUENCY, N_REPEAT = 15, 2
#: Factors on the highest and on the lowest level, and on preloads [-].
HIGHER, LOWER, PRELOADS = 2.0, 1 / 3, (0.5, 2.0)
#: Finer steps are taken where a curve exceeds this share of its maximum [-].
PEAK_SHARE = 0.3
#: Half-width of a band about a resonance in widths of the resonance, and its least relative value [-].
WIDTHS, LEAST_WIDTH = 4.0, 5e-3
#: Number of bands about further resonances, up to this multiple of the measured frequencies [-].
N_BAND, HIGHEST = 2, 4.0
#: Number of places of an added mass, and its size over the mass that shifts a resonance by `SHIFT` [-].
N_MASS, MASS = 2, 8.0
#: Largest number of places of a further sensor [-].
N_PLACE = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Tested:
    """Measured points of a campaign.

    Parameters
    ----------
    levels, frequencies
        Levels, ascending, shape (l,) [unit of the drive], and frequencies, ascending, shape (n,) [Hz], of the jointed
        structure; of the free one if only that was tested.
    configurations
        Configurations that were tested.
    sensors, motions
        Names of all sensors, and of the motion sensors among them.
    harmonics
        Harmonics of motions.
    sweeps
        Directions of the sweeps.
    """

    __test__ = False  # not a test class of pytest

    levels: Float[NDArray[np.float64], " l"]
    frequencies: Float[NDArray[np.float64], " n"]
    configurations: tuple[str, ...]
    sensors: tuple[str, ...]
    motions: tuple[str, ...]
    harmonics: tuple[int, ...]
    sweeps: tuple[int, ...]

    @classmethod
    def of_campaign(cls, campaign: Campaign, sweeps: tuple[int, ...], *, held_out: bool = False) -> "Tested":
        """Summary of a campaign with its sweep directions; if `held_out`, of its held-out levels if there are any."""
        table = campaign.measurement
        at_held = np.isin(table.level, campaign.held_out.levels)
        kept = table.where(at_held if held_out and at_held.any() else ~at_held)
        configuration = np.array([item.configuration for item in campaign.tests])[kept.test]
        main = "jointed" if (configuration == "jointed").any() else "free"
        own = kept.where(configuration == main)
        motion = np.array([item.line is None for item in campaign.sensors])
        read = [campaign.sensors[number] for number in np.unique(own.sensor)]
        return cls(
            levels=np.unique(own.level), frequencies=np.unique(own.frequency),
            configurations=tuple(np.unique(configuration).tolist()), sensors=tuple(item.name for item in read),
            motions=tuple(item.name for item in read if item.line is None),
            harmonics=tuple(int(item) for item in np.unique(own.harmonic[motion[own.sensor]]) if item),
            sweeps=sweeps,
        )  # fmt: skip

    @property
    def configuration(self) -> str:
        """Configuration of the levels and frequencies."""
        return "jointed" if "jointed" in self.configurations else "free"


def list_tests(tested: Tested, model: Model, peak: Float[NDArray[np.float64], " n"]) -> list[NextTest]:
    """Possible next tests, each with the sensors of the campaign, and with one further sensor.

    Parameters
    ----------
    tested
        Measured points.
    model
        Best model.
    peak
        Largest motion of any sensor at each measured frequency at the highest level, shape (n,) [any unit].
    """
    bare = [*_list_bare(tested, model, peak)]
    moving = _list_moving(tested, model)
    return [replace(item, place=place) for item in bare for place in (None, *moving)]


def _list_bare(tested: Tested, model: Model, peak: Float[NDArray[np.float64], " n"]) -> Iterator[NextTest]:
    highest = float(tested.levels[-1])
    ends = tuple(dict.fromkeys((float(tested.levels[0]), highest)))
    again = NextTest(
        name=AGAIN, configuration=tested.configuration, levels=ends,
        frequencies=_thin(tested.frequencies), sensors=tested.sensors, harmonics=tested.harmonics or (1,),
        sweeps=tested.sweeps, n_repeat=N_REPEAT,
    )  # fmt: skip
    yield again
    yield replace(again, name="a higher level", levels=(_round(HIGHER * highest),))
    yield replace(again, name="a lower level", levels=(_round(LOWER * float(tested.levels[0])),))
    near = tested.frequencies[peak > PEAK_SHARE * peak.max(initial=0.0)]
    if len(near) > 1:
        finer = tuple(_round(item, 6) for item in np.linspace(near[0], near[-1], N_FREQUENCY))
        yield replace(again, name="finer steps at the resonance", levels=(highest,), frequencies=finer)
    if 3 not in tested.harmonics and model.system.joints and model.n_harmonic > 3:
        yield replace(again, name="the third harmonic as well", levels=(highest,), harmonics=(*again.harmonics, 3))
    if len(tested.sweeps) == 1:
        back = tuple(-way for way in tested.sweeps)
        name = "the sweep down" if back == (-1,) else "the sweep up"
        yield replace(again, name=name, levels=(highest,), sweeps=back)
    yield from _list_bands(again, model, highest)
    if "free" not in tested.configurations and model.lines:
        yield from _list_free(again, tested, model, highest)
    yield from _list_changed(again, model, highest)


def _list_bands(like: NextTest, model: Model, level: float) -> Iterator[NextTest]:
    """Bands about the next resonances of the structure with its contacts stuck."""
    system = model.in_configuration(like.configuration).system
    resonance = find_resonance(system, level)
    if resonance is None:
        return
    lowest, highest, count = like.frequencies[0], like.frequencies[-1], 0
    for number, omega in enumerate(resonance.angular_frequencies):
        natural = float(omega) / (2 * np.pi)
        if natural > HIGHEST * highest or count == N_BAND:
            return
        band = surround_resonance(resonance, number)
        if band is None or (natural >= lowest and natural <= highest):
            continue
        count += 1
        yield replace(like, name=f"the resonance near {_round(natural):g} Hz", levels=(level,), frequencies=band)


def _list_free(like: NextTest, tested: Tested, model: Model, highest: float) -> Iterator[NextTest]:
    """The structure without the contacts of its lines, at a level that does not exceed the amplitude with them."""
    free, jointed = find_resonance(model.without_contacts().system, 1.0), find_resonance(model.system, highest)
    if free is None or jointed is None:
        return
    band = surround_resonance(free, free.number)
    rows = [item.row for item in model.sensors if isinstance(item, Sensor)]
    moved = max(free.amplitude(row) for row in rows) if rows else 0.0
    if band is None or not moved:
        return
    level = _round(min(highest, max(jointed.amplitude(row) for row in rows) / moved))
    yield replace(
        like, name="the structure without its contacts", configuration="free", levels=(level,), frequencies=band,
        sensors=tested.motions, sweeps=(),
    )  # fmt: skip


def _list_changed(like: NextTest, model: Model, highest: float) -> Iterator[NextTest]:
    """A mass added at the places that move most, and other preloads."""
    if like.configuration == "free":
        return
    scale = _make_tested(model, highest)
    if scale is None:
        return
    by_motion = sorted(
        (name for name, row in model.places.items() if row.any()), key=lambda name: -scale.amplitude(model.places[name])
    )
    for place in by_motion[:N_MASS]:
        mass = scale.point_mass(find_mass_rows(model, place))
        if mass is not None and mass > 0:
            lower = tuple(_round((1 - MASS * SHIFT) * item, 6) for item in like.frequencies)
            yield replace(
                like, name=f"with a mass of {_round(1e3 * MASS * mass):g} g added at {place}", levels=(highest,),
                frequencies=lower, added_mass=(place, float(MASS * mass)),
            )  # fmt: skip
    if any(contact.preload for line in model.lines for contact in map(model.contact, model.lines[line])):
        for factor in PRELOADS:
            yield replace(like, name=f"with preloads times {factor:g}", levels=(highest,), preload=factor)


def _make_tested(model: Model, level: float) -> Scale | None:
    try:
        return measure_scale(model, level=level, configurations={"jointed"})
    except EffectError:
        return None


def _list_moving(tested: Tested, model: Model) -> list[str]:
    """Places without a sensor that move, largest motion first."""
    scale = _make_tested(model, float(tested.levels[-1]))
    free = list_free_places(model, tested.sensors)
    if scale is None:
        return free[:N_PLACE]
    rows = [*model.places.values()]
    share = {name: scale.share(model.places[name], rows) for name in free}
    return sorted((name for name in free if share[name] > MOVES), key=lambda name: -share[name])[:N_PLACE]


def surround_resonance(resonance: ResonanceModel, number: int) -> tuple[float, ...] | None:
    """Frequencies about a resonance; None if the force does not excite it."""
    own = replace(resonance, number=number)
    omega, drive = own.angular_frequency, np.abs(own.system.dynamic @ own.mode_shapes).max(axis=0)
    if not omega > 0 or drive[number] < DRIVEN * drive.max():
        return None
    width = max(WIDTHS * own.modal_damping / omega, LEAST_WIDTH)
    # Denser at the resonance.
    away = np.linspace(-1, 1, N_FREQUENCY)
    away = np.sign(away) * np.abs(away) ** 1.5
    return tuple(_round(item, 6) for item in omega / (2 * np.pi) * (1 + width * away))


def _thin(frequencies: Sequence[float] | Float[NDArray[np.float64], " n"]) -> tuple[float, ...]:
    """At most `N_FREQUENCY` of some frequencies, including both ends."""
    count = min(len(frequencies), N_FREQUENCY)
    places = np.linspace(0, len(frequencies) - 1, count).round().astype(int)
    return tuple(float(frequencies[place]) for place in places)


def _round(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")
