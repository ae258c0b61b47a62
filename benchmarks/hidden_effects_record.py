"""Record of one campaign of the hidden-effect test: a line of JSON."""

import json
import math
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

#: Findings of a verdict, and the finding of a campaign that could not be made or diagnosed.
MISSING, AMBIGUOUS, NONE, UNKNOWN, FAILED = "missing", "ambiguous", "nothing", "unknown", "failed"


@dataclass(frozen=True, kw_only=True)
class Planted:
    """Planted effect: kind, place and strength on the bench; name (`effect`) and `value` in the catalogue."""

    kind: str
    place: str = ""
    strength: float = 0.0
    unit: str = ""
    unit_strength: float = 0.0
    effect: str = ""
    value: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """Effect with a full fit: strength, deviation and vanishing strength in its unit, relative errors."""

    effect: str
    kind: str
    strength: float
    deviation: float
    vanishes: float
    gain: float
    error: float
    held_error: float
    held_chi2: float


@dataclass(frozen=True, kw_only=True)
class Found:
    """Place where an unknown force would explain most."""

    name: str
    gain: float
    exponent: float
    exponent_deviation: float
    phase: float
    configuration: str


@dataclass(frozen=True, kw_only=True)
class Record:
    """Record of one campaign that was made and diagnosed.

    Parameters
    ----------
    row, seed, without
        Row of the score, seed, and kinds of effects that were excluded from the catalogue.
    finding, sentence, named
        Verdict, and the effects that it names, best first.
    ranking
        All refits, best first.
    scores
        Gains of the screening by name, best first.
    error, held_error, held_chi2
        Errors and reduced chi-squared of the fit of the calibration parameters alone.
    floor, noise_floor
        Error of the true model on the held-out data from the whole covariance, and from the noise of the readings
        alone.
    threshold
        Detection threshold of the gain.
    make_seconds, diagnose_seconds
        Processor time [s].
    code
        Digest of the code of the program.
    failure
        Sentence on the failure; empty without one.
    """

    row: str
    seed: int
    planted: Planted
    finding: str
    without: tuple[str, ...] = ()
    sentence: str = ""
    named: tuple[Fitted, ...] = ()
    ranking: tuple[Fitted, ...] = ()
    scores: dict[str, float] = field(default_factory=dict)
    error: float = math.nan
    held_error: float = math.nan
    held_chi2: float = math.nan
    floor: float = math.nan
    noise_floor: float = math.nan
    threshold: float = math.nan
    place: Found | None = None
    make_seconds: float = math.nan
    diagnose_seconds: float = math.nan
    code: str = ""
    failure: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that the verdict names."""
        return tuple(item.effect for item in self.named)

    @property
    def line(self) -> str:
        """Record as JSON; non-finite numbers become null."""
        return json.dumps(_finite(asdict(self)), allow_nan=False)

    @classmethod
    def of_line(cls, line: str) -> "Record":
        """Record from a line of JSON."""
        read = json.loads(line)
        place = read.pop("place")
        fields: dict[str, Any] = {
            **_numbers(read),
            "planted": Planted(**_numbers(read["planted"])),
            "without": tuple(read["without"]),
            "named": tuple(Fitted(**_numbers(item)) for item in read["named"]),
            "ranking": tuple(Fitted(**_numbers(item)) for item in read["ranking"]),
            "place": Found(**_numbers(place)) if place is not None else None,
        }
        return cls(**fields)


def append(file: Path, record: Record) -> None:
    """Append a record with one system call, so that lines of two processes do not mix, and flush it to the disk."""
    torn = file.exists() and (text := file.read_bytes()) and not text.endswith(b"\n")
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(descriptor, f"{chr(10) if torn else ''}{record.line}\n".encode())
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read(file: Path) -> list[Record]:
    """Records of a file, the last of each row and seed; a line that an interruption left incomplete is skipped."""
    records: dict[tuple[str, int], Record] = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            record = Record.of_line(line)
        except json.JSONDecodeError:
            continue
        records[record.row, record.seed] = record
    return [*records.values()]


def of_rows(records: Iterable[Record], rows: Iterable[str]) -> list[Record]:
    """Records of the given rows."""
    wanted = set(rows)
    return [record for record in records if record.row in wanted]


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _numbers(table: dict[str, Any]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in table.items()}
