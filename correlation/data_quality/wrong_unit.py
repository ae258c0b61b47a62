r"""Channels, and whole tests, with a factor of a power of ten: millimetres taken for metres.

The ratio of readings to predictions, :math:`r = \operatorname{median} \log_{10} |X_m / X_p|` over the frequencies of
a run, is some tenths for an error of the model, and an integer for a wrong unit. A part common to all channels of a run
is an error of the model or of the level; a part of one channel alone is an error of this channel.
"""

from collections.abc import Iterator, Set
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Suspicion
from correlation.data_quality.model_ratio import find_model_ratios
from correlation.prediction import Points
from correlation.row_group import group_medians, group_rows

#: Least number of points of a run for a ratio, and largest median distance of their logarithms from the median [-],
#: absolute or relative to the other channels: noise, or a response near zero in the model, has no common ratio.
FEWEST, STEADY = 3, 0.15
#: Largest distance of the logarithm from an integer, relative to the other channels of the run and to the model [-].
BESIDE, MODEL = 0.1, 0.3
#: Largest logarithm of a ratio that a wrong model explains [-]: a factor of 50. A factor of ten is suspected only if
#: the same channel is correct elsewhere.
WRONG_MODEL = 1.7
#: Least logarithm of the factor on all motions at a suspected level [-]: a factor of 1.25; and least ratio of it to the
#: distance of most readings, the fraction `MOST` of them, in amplitude or phase. A wrong level is one factor at all
#: frequencies, a shifted resonance is not: of 20,000 random models with errors of up to four half-widths of a peak, 0
#: look like one (1 in 6 by the size of the factor alone), and 97 % of 5,000 wrong levels are still found.
ONE_LEVEL, CONSTANT, MOST = 0.1, 1.5, 0.9
#: Possible wrong unit of a value, by the power of ten of its ratio to SI.
UNITS = {
    "displacement": {2: "cm", 3: "mm", 6: "um", 9: "nm"},
    "velocity": {2: "cm/s", 3: "mm/s", 6: "um/s"},
    "acceleration": {-1: "g_n", 2: "cm/s^2", 3: "mm/s^2", 6: "um/s^2"},
    CONTACT_FORCE: {-3: "kN", 2: "gf", 3: "mN", 6: "uN"},
}
#: Possible wrong unit of a level, by the power of ten of the ratio of all responses at it.
LEVEL_UNITS = {"N": {3: "kN", -3: "mN", -6: "uN", -2: "gf"}, "m/s^2": {1: "g_n", -2: "cm/s^2", -3: "mm/s^2"}}
MOTION_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
ROTATIONS = {3: "mrad", 6: "urad"}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Runs:
    """Runs, one row per run and channel: test, sensor, level, repeat, logarithm of measured over predicted.

    `spread` is the distance of most readings from a real factor, positive or negative, in the same logarithm.
    """

    test: Int[NDArray[np.int64], " n"]
    sensor: Int[NDArray[np.int64], " n"]
    level: Float[NDArray[np.float64], " n"]
    repeat: Int[NDArray[np.int64], " n"]
    ratio: Float[NDArray[np.float64], " n"]
    spread: Float[NDArray[np.float64], " n"]


def find_wrong_units(
    campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Suspicion, ...]:
    """Channels whose values are probably in another unit than stated in the column.

    Parameters
    ----------
    campaign
        Campaign.
    points, predicted
        Points and the prediction of the model there, shape (k,).
    """
    runs = _arrange_runs(campaign, points, predicted)
    power, beside = _find_powers_of_ten(runs)
    moves = np.array([sensor.quantity != CONTACT_FORCE for sensor in campaign.sensors])
    result: list[Suspicion] = []
    for test in np.unique(runs.test).tolist():
        here = runs.test == test
        # The force of a line is not proportional to the level once the line slips.
        motions = here & moves[runs.sensor]
        powers = np.unique(power[motions])
        if len(powers) == 1 and powers[0] and len(np.unique(runs.sensor[motions])) > 1:
            result.append(_describe_level(campaign, test, float(np.median(runs.ratio[motions])), int(powers[0])))
            continue
        result += _suspect_levels(campaign, runs, motions)
        for sensor in np.unique(runs.sensor[here]):
            for item in np.unique(power[here & (runs.sensor == sensor)]).tolist():
                chosen = here & (runs.sensor == sensor) & (power == item)
                if item:
                    result.append(_describe_channel(campaign, runs, chosen, beside, power == 0))
    return tuple(result)


def _arrange_runs(campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]) -> _Runs:
    table, of_model = find_model_ratios(campaign, points, predicted)
    logarithm = np.log10(np.abs(of_model))
    turned = np.where(np.array([item.has_phase for item in campaign.sensors])[table.sensor], np.angle(of_model), 0.0)
    # A sensor with reversed polarity has a constant factor as well.
    turned = ((turned + np.pi / 2) % np.pi - np.pi / 2) / np.log(10)
    run = [table.test, table.level, table.repeat]
    # If the resonance of the model has an error, all channels change together.
    state = group_rows([*run, table.sweep, table.frequency]).number
    common = group_medians(state, logarithm)
    channel = group_rows([*run, table.sensor]).number
    first, ratio, spread = [], [], []
    for number in range(channel.max(initial=-1) + 1):
        values = np.flatnonzero(channel == number)
        apart = min(_scatter(logarithm[values]), _scatter(logarithm[values] - common[state[values]]))
        if len(values) >= FEWEST and apart < STEADY:
            first.append(int(values[0]))
            ratio.append(float(np.median(logarithm[values])))
            spread.append(float(np.quantile(np.hypot(logarithm[values] - ratio[-1], turned[values]), MOST)))
    kept, ratios = table.where(np.array(first, dtype=np.int64)), np.array(ratio)
    if not campaign.drive.calibrated and len(ratios):
        # The common factor of all readings is unknown; of two groups the smaller values count as right.
        ratios -= np.quantile(ratios, 0.5, method="lower")
    return _Runs(
        test=kept.test, sensor=kept.sensor, level=kept.level, repeat=kept.repeat, ratio=ratios,
        spread=np.array(spread),
    )  # fmt: skip


def _scatter(values: Float[NDArray[np.float64], " v"]) -> float:
    return float(np.median(np.abs(values - np.median(values))))


def _find_powers_of_ten(runs: _Runs) -> tuple[Int[NDArray[np.int64], " n"], Float[NDArray[np.float64], " n"]]:
    """Power of ten of the error of each run, mostly 0, and the logarithm of the other channels, shape (n,)."""
    beside, power = np.zeros(len(runs.ratio)), np.rint(runs.ratio).astype(np.int64)
    for number in range(len(power)):
        others = _mask_like_runs(runs, number) & (runs.sensor != runs.sensor[number])
        beside[number] = np.median(runs.ratio[others]) if others.any() else np.nan
    apart = np.where(np.isfinite(beside), runs.ratio - beside, runs.ratio)
    whole = np.minimum(np.abs(apart - power), np.abs(apart)) < BESIDE
    result = whole & (np.abs(runs.ratio) > WRONG_MODEL) & (np.abs(runs.ratio - power) < MODEL)
    right = np.abs(runs.ratio) < MODEL
    for number in np.flatnonzero((np.abs(power) == 1) & (np.abs(apart - power) < BESIDE)).tolist():
        elsewhere = (runs.sensor == runs.sensor[number]) & right
        result[number] = bool(elsewhere.any()) and abs(beside[number]) < MODEL
    return np.where(result, power, 0), beside


def _mask_like_runs(runs: _Runs, number: int) -> Bool[NDArray[np.bool_], " n"]:
    return np.asarray(
        (runs.test == runs.test[number]) & (runs.level == runs.level[number]) & (runs.repeat == runs.repeat[number])
    )


def _suspect_levels(campaign: Campaign, runs: _Runs, motions: Bool[NDArray[np.bool_], " n"]) -> list[Suspicion]:
    """Levels at which all motions have a common factor, if they are right at all others."""
    result, levels = [], np.unique(runs.level[motions])
    middle = {level: float(np.median(runs.ratio[motions & (runs.level == level)])) for level in levels.tolist()}
    for level, ratio in middle.items():
        own, others = motions & (runs.level == level), motions & (runs.level != level)
        if len(levels) < 3 or len(np.unique(runs.sensor[own])) < 2:
            continue
        usual = max(abs(item) for other, item in middle.items() if other != level)
        apart = max(np.abs(runs.ratio[own] - ratio).max(), np.abs(runs.ratio[others]).max(), usual)
        if abs(ratio) > max(ONE_LEVEL, 3 * apart, CONSTANT * float(np.median(runs.spread[own]))):
            result.append(
                Suspicion(
                    where=f'test "{campaign.tests[int(runs.test[own][0])].name}", level {level:.4g} '
                    f"{campaign.drive.unit}",
                    sentence=f"all its sensors read about {format_times(ratio)} what the model says, at the other "
                    f"levels {format_times(min(middle.values(), key=abs))}: is this level right?",
                )
            )
    return result


def _describe_level(campaign: Campaign, test: int, ratio: float, power: int) -> Suspicion:
    stated = campaign.drive.unit
    unit = LEVEL_UNITS.get(stated, {}).get(power)
    asked = f"is its level in {unit} instead of {stated}" if unit else "is its level in another unit than stated"
    length = name_length(power, {sensor.quantity for sensor in campaign.sensors if not sensor.unit.startswith("rad")})
    columns, other = ("", "") if not length else (" or those of the columns", f", or {length}")
    return Suspicion(
        where=f'test "{campaign.tests[test].name}"',
        sentence=f"all its sensors read about {format_times(ratio)} what the model says: {asked}{other}? "
        f"If so, correct units.level of the manifest{columns}; if not, the load of the case",
        of_test=True,
    )


def _describe_channel(
    campaign: Campaign,
    runs: _Runs,
    chosen: Bool[NDArray[np.bool_], " n"],
    beside: Float[NDArray[np.float64], " n"],
    right: Bool[NDArray[np.bool_], " n"],
) -> Suspicion:
    test, sensor = int(runs.test[chosen][0]), int(runs.sensor[chosen][0])
    ratio, of = float(np.median(runs.ratio[chosen])), campaign.sensors[sensor]
    evidence = [f"it reads {format_times(ratio)} what the model says"]
    if np.isfinite(beside[chosen]).any():
        evidence.append(f"the other sensors of the same runs {format_times(float(np.nanmedian(beside[chosen])))}")
    elsewhere = (runs.sensor == sensor) & right
    if elsewhere.any():
        own = format_times(float(np.median(runs.ratio[elsewhere])))
        evidence.append(f"and itself {own} in {_describe_right_runs(campaign, runs, elsewhere, test)}")
    units = ROTATIONS if of.unit.startswith("rad") else UNITS[of.quantity]
    unit = units.get(round(ratio))
    asked = f"are its values in {unit} instead of {of.unit}?" if unit else "are its values in another unit than stated?"
    part = "".join(_describe_runs(runs, chosen, test, sensor, campaign.drive.unit))
    return Suspicion(
        where=f'test "{campaign.tests[test].name}", sensor "{of.name}"',
        sentence=f"{part}{', '.join(evidence)}: {asked} If so, correct the column unit",
    )


def _describe_runs(
    runs: _Runs, chosen: Bool[NDArray[np.bool_], " n"], test: int, sensor: int, level_unit: str
) -> Iterator[str]:
    """Runs of the channel in words; empty for all."""
    channel = (runs.test == test) & (runs.sensor == sensor)
    for name, column, unit in (("level", runs.level, f" {level_unit}"), ("repeat", runs.repeat, "")):
        values = np.unique(column[chosen])
        if len(values) < len(np.unique(column[channel])):
            yield f"at the {name} " if len(values) == 1 else f"at the {name}s "
            yield f"{', '.join(f'{value:.4g}' for value in values)}{unit} "


def _describe_right_runs(campaign: Campaign, runs: _Runs, rows: Bool[NDArray[np.bool_], " n"], test: int) -> str:
    """Runs in which a channel is right, in words."""
    names = [f'"{campaign.tests[item].name}"' for item in np.unique(runs.test[rows]) if item != test]
    return f"test {' and '.join(names)}" if names else "its other runs"


def name_length(power: int, quantities: Set[str]) -> str:
    """Question for the unit of length that explains a power of ten; empty if no usual unit does.

    Parameters
    ----------
    power
        Power of ten of measured over expected.
    quantities
        Quantities of the sensors that have it.
    """
    names = []
    for quantity in sorted(quantities & MOTION_UNITS.keys()):
        si, other = MOTION_UNITS[quantity], UNITS[quantity].get(abs(power))
        if other:
            names.append(f"in {other} and read as {si}" if power > 0 else f"in {si} and read as {other}")
    return f"are its values {' or '.join(names)}" if names else ""


def format_times(logarithm: float) -> str:
    """A factor in words, without an exponent, from its decimal logarithm."""
    factor = float(f"{10**logarithm:.3g}")
    return f"{factor:,.10g} times" if 1e-4 <= factor < 1e7 else f"{factor:g} times"
