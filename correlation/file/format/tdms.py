"""TDMS files of LabVIEW: groups of channels with their properties."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, make_unique_names
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.unit_label import read_unit, split_label
from geometry.trial_process import read_in_trial_process

#: Lowest reading speed on any machine [byte/s], and memory for each byte of the file [-]: its numbers are read twice,
#: and may be widened from one byte to eight.
SPEED, MEMORY = 5e6, 20


def recognise(head: bytes) -> bool:
    """Whether a file begins with a segment of TDMS."""
    return head[:4] == b"TDSm"


def read(path: Path) -> MeasuredFile:
    """Read channels as columns ``group/channel``; channels with equal sampling share a column of time."""
    from nptdms import TdmsFile

    if defect := read_in_trial_process(lambda: TdmsFile.read(path), path, speed=SPEED, memory=MEMORY):
        raise _make_damage_error(path, f"it {defect}")
    warned = _Warnings(logging.WARNING)
    loggers = [logging.getLogger(f"nptdms.{module}") for module in ("reader", "tdms_segment", "types", "tdms")]
    handlers = [logger.handlers for logger in loggers]
    try:
        for logger in loggers:
            logger.handlers = [warned]
        content = TdmsFile.read(path)
        _check_complete(path, content)
        columns = _list_columns(
            [(channel, group.properties) for group in content.groups() for channel in group.channels()]
        )
        facts = {key: str(value) for key, value in content.properties.items()}
    except CampaignError:
        raise
    except Exception as error:  # The library fails on damaged files in many ways.
        raise _make_damage_error(path, f"{type(error).__name__}: {error}") from None
    finally:
        for logger, before in zip(loggers, handlers, strict=True):
            logger.handlers = before
    if warned.messages:  # after a warning, the library continues with wrong values
        raise _make_damage_error(path, warned.messages[0])
    return MeasuredFile(
        path=path, format="tdms", title=facts.get("title", facts.get("name", "")), columns=columns, facts=facts
    )


class _Warnings(logging.Handler):
    """Handler that collects the warnings of the library, which would otherwise be printed."""

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Append the message of a warning."""
        self.messages.append(record.getMessage())


def _make_damage_error(path: Path, reason: str) -> CampaignError:
    shown = " ".join(reason.split())[:200]
    return CampaignError(f"{path.name}: is a damaged TDMS file ({shown}); copy it again")


def _check_complete(path: Path, content: Any) -> None:
    """Refuse a file whose last segment is cut."""
    status = content.file_status
    if status.incomplete_final_segment:
        lost = [
            f"{name} has {channel.read_length} of {channel.expected_length} values"
            for name, channel in (status.channel_statuses or {}).items()
        ]
        raise CampaignError(f"{path.name}: is cut: {'; '.join(lost[:3]) or 'its last segment'}; copy it again")


def _list_columns(channels: list[tuple[Any, Mapping[str, Any]]]) -> tuple[Column, ...]:
    """Columns of channels and of their times; the facts of a channel include the properties of its group."""
    columns: list[Column] = []
    times: dict[tuple[float, float, int], str] = {}
    for channel, of_group in channels:
        properties = {key: str(value) for key, value in channel.properties.items()}
        shared = {key: str(value) for key, value in of_group.items()}
        name = f"{channel.group_name}/{channel.name}"
        values, words = _read_values(channel[:])
        if values is None:
            continue
        label = properties.get("unit_string") or properties.get("NI_UnitDescription") or ""
        step = float(channel.properties.get("wf_increment", 0) or 0)
        abscissa = None
        if step > 0 and len(values):
            start = float(channel.properties.get("wf_start_offset", 0) or 0)
            key = (start, step, len(values))
            if key not in times:
                times[key] = abscissa = "time" + (f" ({len(times) + 1})" if times else "")
                time = start + step * np.arange(len(values))
                columns.append(Column(name=abscissa, values=time, unit="s", function="time"))
            abscissa = times[key]
        columns.append(
            Column(
                name=name, values=values, unit=read_unit(label, name=name) or split_label(name)[1], unit_label=label,
                abscissa=abscissa, function="time" if abscissa else "", facts={**shared, **properties}, where=name,
                words=words,
            )
        )  # fmt: skip
    names = make_unique_names([column.name for column in columns])
    return tuple(Column(**{**vars(column), "name": name}) for name, column in zip(names, columns, strict=True))


def _read_values(values: NDArray[Any]) -> tuple[NDArray[Any] | None, tuple[str, ...]]:
    """Numbers of a channel, or indices and words of a channel of text; instants become seconds after the first."""
    values = np.asarray(values)
    if values.dtype.kind == "M":
        since = (values - values[:1]).astype("timedelta64[ns]") if len(values) else values
        return since.astype(np.float64) * 1e-9, ()
    if values.dtype.kind in "biufc":
        # Damaged 128-bit numbers may not fit into 64 bits: they become NaN, like missing values.
        with np.errstate(invalid="ignore", over="ignore"):
            return values.astype(np.complex128 if values.dtype.kind == "c" else np.float64), ()
    if values.dtype.kind in "OUS":
        texts = [str(text) for text in values]
        known = {word: number for number, word in enumerate(dict.fromkeys(texts))}
        return np.array([known[text] for text in texts], dtype=np.float64), tuple(known)
    return None, ()


MEASURED_FILES.register(
    MeasuredFileFormat(name="tdms", holds="a TDMS file (.tdms)", suffixes=(".tdms",), recognise=recognise, read=read)
)
