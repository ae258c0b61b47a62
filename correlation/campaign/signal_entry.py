"""Signals of a measured file as described in a manifest: columns, unit, harmonic.

``tip = "acc 1"`` is a column in the unit that its file states; ``tip = { amplitude = "a", phase = "p", unit = "g_n",
phase_unit = "deg" }`` adds what the file does not state.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurable import REMEDY, is_beyond, is_too_large
from correlation.campaign.measurement_unit import COUNT, STRAIN, find_si_factor, read_si_quantity
from correlation.campaign.toml_table import TomlTable
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile

#: Combinations of keys that name the columns of a signal.
COLUMN_KEYS = (("column",), ("real", "imag"), ("amplitude", "phase"), ("amplitude",))
#: Largest plausible phase in radians [rad]: a phase unwrapped over several resonances stays below, unlike degrees.
MOST_RADIANS = 8 * math.pi
#: Factor to peak amplitude by the convention of an amplitude.
PEAK_OF = {"peak": 1.0, "rms": math.sqrt(2.0), "peak to peak": 0.5}
#: Factor to radians by the unit of a phase.
PHASE = {"rad": 1.0, "deg": math.pi / 180, "degree": math.pi / 180}


@dataclass(frozen=True, kw_only=True)
class SignalEntry:
    """Description of a signal of a measured file.

    Parameters
    ----------
    where
        File and key of the manifest, for messages.
    columns
        Names of its columns by part: "column"; "real" and "imag"; "amplitude" and optionally "phase".
    unit
        Unit of its values; empty for the unit of the column.
    phase_unit
        "rad" or "deg"; empty for the unit of the column.
    sensitivity
        Reading per unit of the quantity, such as "100 mV/g_n" or "655.36 count/(m/s^2)"; empty if the columns hold the
        quantity itself.
    convention
        Convention of its amplitudes, "peak", "rms" or "peak to peak"; empty for that of the campaign.
    harmonic
        Harmonic of its values [-].
    sign
        -1 for a sensor that is mounted in the opposite direction, or a phase that is measured from it [-].
    gaps
        Remedy for values that are not finite, for messages.
    """

    where: str
    columns: Mapping[str, str]
    unit: str = ""
    phase_unit: str = ""
    sensitivity: str = ""
    convention: str = ""
    harmonic: int = 1
    sign: int = 1
    gaps: str = 'leave these rows out of the file, or add missing = "skip" to its table'

    @property
    def has_phase(self) -> bool:
        """Whether its values have a phase or a sign."""
        return "amplitude" not in self.columns or "phase" in self.columns

    def peak(self, common: float) -> float:
        """Factor from its `complex_values` to peak amplitudes, given the factor of the campaign [-]."""
        return 1.0 if self.convention else common

    def problem(self, text: str) -> CampaignError:
        """Error with the place of the signal in the manifest."""
        return CampaignError(f"{self.where}: {text}")

    def or_unit(self, file: MeasuredFile, unit: str) -> "SignalEntry":
        """Copy with a default unit, used if neither the manifest nor the file states a unit."""
        has_unit = self.unit or any(file.column(name).unit for name in self.columns.values())
        return self if has_unit else replace(self, unit=unit)

    def complex_values(self, file: MeasuredFile, si: str) -> Complex[NDArray[np.complex128], " n"]:
        """Values in SI, shape (n,), as peaks if it has a convention; amplitudes without phase are real, not negative.

        Parameters
        ----------
        file
            File with its columns.
        si
            SI unit that is needed; empty for a sensor that is not calibrated, whose values are not converted.

        Raises
        ------
        CampaignError
            A column does not exist, has another length or unit, or has values that are not finite or too large.
        """
        parts = {part: file.column(name) for part, name in self.columns.items()}
        lengths = {len(column.values) for column in parts.values()}
        if len(lengths) > 1:
            raise self.problem(f"its columns in {file.path.name} have different lengths {sorted(lengths)}: correct one")
        for column in parts.values():
            _require_measurable(self, file, column)
        first = next(iter(parts.values()))
        factor = self.sign * self._factor(file, first, si) * self._own_peak()
        if "column" in parts:
            return np.asarray(factor * parts["column"].values, dtype=np.complex128)
        for part, column in parts.items():
            if np.iscomplexobj(column.values):
                raise self.problem(f'"{column.name}" is complex: give it as column = "{column.name}", not as {part}')
        if "real" in parts:
            return np.asarray(factor * (parts["real"].values + 1j * parts["imag"].values))
        if (parts["amplitude"].values < 0).any():
            row = int(np.argmax(parts["amplitude"].values < 0))
            raise self.problem(
                f'"{first.name}" is an amplitude and is {first.values[row]:.4g} at row {row + 1}: an amplitude is not '
                "negative; give a signed reading as column"
            )
        if "phase" not in parts:
            return np.asarray(abs(factor) * parts["amplitude"].values, dtype=np.complex128)
        return np.asarray(factor * parts["amplitude"].values * np.exp(1j * self._phase(parts["phase"])))

    def real_values(self, file: MeasuredFile, si: str) -> Float[NDArray[np.float64], " n"]:
        """Real values in SI, shape (n,); see `complex_values`.

        Raises
        ------
        CampaignError
            As `complex_values`, or the values are complex.
        """
        if "column" not in self.columns and self.has_phase:
            raise self.problem("is one real number per row: name its column")
        values = self.complex_values(file, si)
        if np.iscomplexobj(file.column(next(iter(self.columns.values()))).values):
            raise self.problem("is complex in its file: name a real column")
        return np.asarray(values.real)

    def is_in(self, file: MeasuredFile, si: str) -> bool:
        """Whether the manifest or its first column states a unit that converts to an SI unit."""
        unit = self.unit or file.column(next(iter(self.columns.values()))).unit
        try:
            return bool(unit) and not self.sensitivity and find_si_factor(unit, si) > 0
        except ValueError:
            return False

    def positive_values(self, file: MeasuredFile, si: str) -> Float[NDArray[np.float64], " n"]:
        """Positive values in SI, such as frequencies and levels, shape (n,); see `real_values`.

        Raises
        ------
        CampaignError
            As `real_values`, or a value is not positive or outside the range of readings.
        """
        values = self.real_values(file, si)
        for wrong, why in ((~(values > 0), "it must be above 0"), (is_beyond(values), REMEDY)):
            if wrong.any():
                row = int(np.argmax(wrong))
                raise self.problem(f"is {values[row]:g} at row {row + 1} of {file.path.name}: {why}")
        return values

    def suspect_degrees(self, file: MeasuredFile) -> str:
        """Suspicion that a phase in radians is in degrees; empty if it is not suspicious."""
        if "phase" not in self.columns:
            return ""
        column = file.column(self.columns["phase"])
        largest = float(np.abs(column.values).max(initial=0.0))
        if (self.phase_unit or column.unit) != "rad" or largest <= MOST_RADIANS:
            return ""
        return (
            f'the phase "{column.name}" reaches {largest:.4g} rad, {largest / (2 * math.pi):.0f} turns: are these '
            'degrees? then write phase_unit = "deg"'
        )

    def _phase(self, column: Column) -> Float[NDArray[np.float64], " n"]:
        unit = self.phase_unit or column.unit
        if unit not in PHASE:
            raise self.problem(
                f'the phase "{column.name}" {f"is in {unit}" if unit else "has no unit"}: add phase_unit = "deg" or '
                'phase_unit = "rad"'
            )
        return np.asarray(PHASE[unit] * column.values)

    def _own_peak(self) -> float:
        """Factor to peak amplitude by its own convention; 1 for a mean or without convention [-]."""
        return PEAK_OF[self.convention] if self.convention and self.harmonic else 1.0

    def _factor(self, file: MeasuredFile, column: Column, si: str) -> float:
        """Factor from the unit of the column to SI."""
        if not si:
            return 1.0
        unit = self.unit or column.unit
        if not unit:
            remedy = f'write {{ column = "{column.name}", unit = "{si}" }} with the unit of its values'
            if self.sensitivity:
                remedy = f'add unit = "V", a multiple, "{COUNT}" or "{STRAIN}", as it is in, beside its sensitivity'
            raise self.problem(f'"{column.name}" of {file.path.name} has no unit: {remedy}')
        try:
            if not self.sensitivity:
                return find_si_factor(unit, si)
            read = unit if unit in {COUNT, STRAIN} else "V"
            return find_si_factor(unit, read) / read_si_quantity(self.sensitivity, f"{read}/({si})")
        except ValueError as error:
            raise self.problem(f'"{column.name}" of {file.path.name}: {error}') from None


def read_signal(table: TomlTable, key: str) -> SignalEntry:
    """Read one signal: the name of a column, or a table with its columns.

    Raises
    ------
    CampaignError
        The value is neither, or the combination of columns is not one of `COLUMN_KEYS`.
    """
    value = table.values.get(key)
    table.known.add(key)
    where = table.where(key)
    if isinstance(value, str) and value:
        return SignalEntry(where=where, columns={"column": value})
    if not isinstance(value, dict):
        raise table.problem(key, f'give the name of a column, e.g. {key} = "channel 1"')
    entry = table.within(key, value)
    given = tuple(part for part in ("column", "real", "imag", "amplitude", "phase") if part in value)
    if given not in COLUMN_KEYS:
        raise table.problem(
            key, "give column, or real and imag, or amplitude and phase, or amplitude alone; each the name of a column"
        )
    result = SignalEntry(
        where=where,
        columns={part: entry.take(part, str) for part in given},
        unit=entry.take("unit", str, ""),
        phase_unit=entry.take("phase_unit", str, ""),
        sensitivity=entry.take("sensitivity", str, ""),
        convention=entry.choice("convention", PEAK_OF) if "convention" in value else "",
        harmonic=entry.take("harmonic", int, 1),
        sign=read_sign(entry),
    )
    if result.harmonic < 0:
        raise entry.problem("harmonic", "must be 0 (the mean), 1, 2, ...")
    if result.phase_unit and result.phase_unit not in PHASE:
        raise entry.problem("phase_unit", 'must be "deg" or "rad"')
    entry.finish()
    return result


def read_sign(table: TomlTable) -> int:
    """Read the sign of a channel: -1 for a sensor that is mounted in the opposite direction, 1 by default.

    Raises
    ------
    CampaignError
        The value is neither 1 nor -1.
    """
    sign: int = table.take("sign", int, 1)
    if sign not in {1, -1}:
        raise table.problem("sign", "must be 1 or -1")
    return sign


def _require_measurable(entry: SignalEntry, file: MeasuredFile, column: Column) -> None:
    wrong = np.flatnonzero(~np.isfinite(column.values))
    if len(wrong) == len(column.values):
        raise entry.problem(f'"{column.name}" of {file.path.name} contains no number: a dead channel; remove its entry')
    if len(wrong):
        raise entry.problem(
            f'"{column.name}" of {file.path.name} is not finite at {len(wrong)} of {len(column.values)} rows, first '
            f"at row {wrong[0] + 1}: {entry.gaps}"
        )
    if (large := is_too_large(column.values)).any():
        row = int(np.argmax(large))
        raise entry.problem(f'"{column.name}" of {file.path.name} is {column.values[row]:g} at row {row + 1}: {REMEDY}')
