"""Time records: a column ``time`` or a sampling rate, and one column per channel with its unit in the manifest."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement_unit import find_base_unit
from correlation.campaign.signal_entry import SignalEntry
from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.signal.record import note_rounded_time, recover_time_base
from geometry.read_only_array import freeze_fields

#: Remedy for values that are not finite.
GAPS = "a record has no gaps: cut it before or after them"
TIME = "time"
#: Largest deviation of a step from the mean step, relative to it, as for times that are rounded to few digits [-].
UNIFORM = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeRecord:
    """Channels over time.

    Parameters
    ----------
    name
        Name in the manifest.
    time
        Rising instants, shape (n,) [s].
    channels
        Names of the channels: sensors, or a force.
    units
        SI unit of each channel; "V" if it is not calibrated.
    values
        Values of the channels, shape (n_channel, n) [unit of the channel].
    force
        Channel of the driving force; None for a ring-down.
    held_out
        Whether it is held out of calibrations.
    remarks
        Remarks on how its time is read.
    """

    name: str
    time: Float[NDArray[np.float64], " n"]
    channels: tuple[str, ...]
    units: tuple[str, ...]
    values: Float[NDArray[np.float64], "c n"]
    force: str | None = None
    held_out: bool = False
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_fields(self, "time", "values")

    def channel(self, name: str) -> Float[NDArray[np.float64], " n"]:
        """Values of one channel, shape (n,).

        Raises
        ------
        CampaignError
            There is no such channel.
        """
        if name not in self.channels:
            raise CampaignError(f'record "{self.name}" has no channel "{name}": it has {", ".join(self.channels)}')
        values: Float[NDArray[np.float64], " n"] = self.values[self.channels.index(name)]
        return values

    def between(self, start: float, end: float) -> "TimeRecord":
        """Part of the record between two instants [s].

        Raises
        ------
        CampaignError
            The part has fewer than two samples.
        """
        rows = (self.time >= start) & (self.time <= end)
        if rows.all():
            return self
        if rows.sum() < 2:
            raise CampaignError(
                f'record "{self.name}" goes from {self.time[0]:g} to {self.time[-1]:g} s: start and end leave no '
                "samples"
            )
        return replace(self, time=self.time[rows], values=self.values[:, rows])

    @property
    def step(self) -> float:
        """Time from one sample to the next [s].

        Raises
        ------
        CampaignError
            The step varies by more than `UNIFORM`.
        """
        steps = np.diff(self.time)
        mean = float(steps.mean())
        worst = int(np.argmax(np.abs(steps - mean)))
        if abs(steps[worst] - mean) > UNIFORM * mean:
            raise CampaignError(
                f'record "{self.name}" has a step of {steps[worst]:.4g} s after {self.time[worst]:.6g} s, {mean:.4g} s '
                "on average: resample it to a uniform step"
            )
        return mean


def make_record_of_columns(
    file: MeasuredFile,
    *,
    name: str,
    units: Mapping[str, str],
    signs: Mapping[str, int] | None = None,
    force: str | None = None,
    held_out: bool = False,
    rate: float | None = None,
) -> TimeRecord:
    """Make a record from columns of any measured file.

    Parameters
    ----------
    file
        File with the columns.
    name, force, held_out
        As in `TimeRecord`.
    units
        Columns of the record with their units; "time" is needed only if it is neither in seconds nor in the unit that
        the file states.
    signs
        Signs of columns: -1 for a sensor that is mounted in the opposite direction; by default 1 [-].
    rate
        Sampling rate of a file without a column "time" [Hz].

    Raises
    ------
    CampaignError
        A column or a unit cannot be used; one sentence with file, column, value and remedy.
    """
    channels = tuple(column for column in units if column != TIME)
    if not channels:
        raise CampaignError(
            f'record "{name}": units names no channel of {file.path.name}: add one, such as acc = "g_n"'
        )
    if force is not None and force not in channels:
        raise CampaignError(f'record "{name}": force = "{force}" is not a channel: add {force} = "N" to its units')
    values, si = [], []
    for column in channels:
        try:
            si.append(find_base_unit(units[column])[1])
        except ValueError as error:
            raise CampaignError(f'record "{name}": units.{column}: {error}') from None
        entry = SignalEntry(
            where=f'record "{name}"', columns={"column": column}, unit=units[column], sign=(signs or {}).get(column, 1),
            gaps=GAPS,
        )  # fmt: skip
        values.append(entry.real_values(file, si[-1]))
    if len({len(signal) for signal in values}) > 1:
        raise CampaignError(f'record "{name}": its channels in {file.path.name} have different lengths: correct one')
    remarks: tuple[str, ...] = ()
    if rate is not None:
        time = np.arange(len(values[0])) / rate
    else:
        entry = SignalEntry(
            where=f'record "{name}": {TIME}', columns={"column": TIME}, unit=units.get(TIME, ""), gaps=GAPS
        )
        time = entry.or_unit(file, "s").real_values(file, "s")
        if len(time) != len(values[0]):
            raise CampaignError(
                f'record "{name}": "{TIME}" of {file.path.name} is not as long as its channels: correct it'
            )
        remarks, clock = note_rounded_time(time), recover_time_base(time)
        time = time if clock is None else clock
        if (np.diff(time) <= 0).any():
            row = int(np.argmax(np.diff(time) <= 0)) + 1
            raise CampaignError(
                f"{file.path.name}: time does not rise at row {row + 1}; sort the rows, or give the sampling rate"
            )
    return TimeRecord(
        name=name,
        time=time,
        channels=channels,
        units=tuple(si),
        values=np.array(values),
        force=force,
        held_out=held_out,
        remarks=remarks,
    )
