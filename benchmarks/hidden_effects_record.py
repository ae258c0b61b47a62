"""What is kept of one campaign: a line of JSON."""

import json
import math
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

#: Findings of a verdict, and of a campaign that could not be made or diagnosed.
MISSING, AMBIGUOUS, NONE, UNKNOWN, FAILED = "missing", "ambiguous", "nothing", "unknown", "failed"


@dataclass(frozen=True, kw_only=True)
class Planted:
    """The truth: as the bench says it, and as the catalogue would."""

    kind: str
    place: str = ""
    strength: float = 0.0
    unit: str = ""
    unit_strength: float = 0.0
    effect: str = ""
    value: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """An effect fitted in earnest; strength, deviation and the vanishing strength in its unit, errors relative."""

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
    """Where an unknown force would explain most."""

    name: str
    gain: float
    exponent: float
    exponent_deviation: float
    phase: float
    configuration: str


@dataclass(frozen=True, kw_only=True)
class Record:
    """One campaign, made and diagnosed.

    Parameters
    ----------
    row, seed, without
        Of the score; kinds of effects that were left out of the catalogue.
    finding, sentence, named
        The verdict, and the effects that it names, best first.
    ranking
        All refits, best first.
    scores
        Gains of the screening by name, best first.
    error, held_error, held_chi2
        Of the calibration parameters alone.
    floor, noise_floor
        Error that the true model would have on the held-out data by all that its covariance knows, and by the noise of
        the readings alone.
    threshold
        Gain that chance exceeds in the share of nulls allowed.
    make_seconds, diagnose_seconds
        Processor time [s].
    code
        Digest of the product's code.
    failure
        In a sentence.
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
        """As JSON; numbers that are not finite become null."""
        return json.dumps(_finite(asdict(self)), allow_nan=False)

    @classmethod
    def of_line(cls, line: str) -> "Record":
        """From JSON."""
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
    """Write a line by one call of the system, so that lines of two processes never mix, and on to the disk."""
    torn = file.exists() and (text := file.read_bytes()) and not text.endswith(b"\n")
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(descriptor, f"{chr(10) if torn else ''}{record.line}\n".encode())
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read(file: Path) -> list[Record]:
    """Records of a file, the last of each row and seed; a line that an interruption has torn is left out."""
    records: dict[tuple[str, int], Record] = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            record = Record.of_line(line)
        except json.JSONDecodeError:
            continue
        records[record.row, record.seed] = record
    return [*records.values()]


def of_rows(records: Iterable[Record], rows: Iterable[str]) -> list[Record]:
    """Those of some rows."""
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
