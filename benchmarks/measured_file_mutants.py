"""Read 10,000 damaged test files of all formats: each must give correct data or an error message of one sentence.

Correct data are values of the undamaged file, values that are in the damaged bytes, or the steps of an abscissa whose
first value and step are there. Anything else, such as another exception, a crash, a message of several lines or a value
that is in neither file, is counted as wrong.

    python -m benchmarks.measured_file_mutants [--count N] [--keep FOLDER]
"""

import argparse
import gzip
import re
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured_file_samples import write_samples
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile
from correlation.file.read_file import read_file

SEED = 2027
NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
KINDS = [f"{order}{kind}" for order in "<>" for kind in ("f4", "f8", "i2", "i4", "i8", "u2", "u4", "u8")] + ["i1", "u1"]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Outcome of one damaged file ("right", "sentence" or "wrong") and its reason."""

    outcome: str
    reason: str = ""


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Damage bytes in one to three random ways."""
    damaged = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        size = max(1, len(damaged))
        place, length = int(rng.integers(size)), int(rng.integers(1, 1 + min(40, size)))
        match int(rng.integers(9)):
            case 0:
                damaged[place : place + 1] = bytes([int(rng.integers(256))])
            case 1:
                damaged[place : place + 1] = bytes([int(rng.choice(list(b'0123456789.,;-+eE \n\t"#x')))])
            case 2:
                del damaged[place : place + length]
            case 3:
                damaged[place:place] = rng.integers(0, 256, length, dtype=np.uint8).tobytes()
            case 4:
                del damaged[place:]
            case 5:
                damaged[place:place] = damaged[place : place + length]
            case 6:
                damaged[place : place + length] = bytes(len(damaged[place : place + length]))
            case 7:
                damaged[place : place + 1] = bytes([damaged[place] ^ (1 << int(rng.integers(8)))]) if damaged else b""
            case 8:
                damaged = bytearray(bytes(damaged).replace(b"\n", b"\r\n"))
    return bytes(damaged)


def judge(original: MeasuredFile, path: Path) -> Verdict:
    """Read a damaged file and judge the result."""
    try:
        measured = read_file(path)
    except CampaignError as error:
        message = str(error)
        one = "\n" not in message and path.name in message and len(message) < 700
        return Verdict(outcome="sentence" if one else "wrong", reason=message)
    except BaseException as error:
        return Verdict(outcome="wrong", reason=f"{type(error).__name__}: {error}")
    known = {column.name: column for column in original.columns}
    pool: NDArray[np.float64] | None = None
    abscissas = {column.abscissa for column in measured.columns}
    for column in measured.columns:
        if column.name in known and _same(column, known[column.name]):
            continue
        pool = _numbers_in(path.read_bytes()) if pool is None else pool
        if not column.words and not _is_in_file(column, pool, column.name in abscissas):
            return Verdict(outcome="wrong", reason=f'"{column.name}" has values that stand nowhere')
    reported = any(text.startswith(("not read", "empty", "a second")) for text in measured.facts.values()) or any(
        "not read" in key for key in measured.facts
    )
    if len(measured.columns) < len(original.columns) and not reported and not _is_shorter(original, path):
        counts = f"{len(measured.columns)} of {len(original.columns)}"
        return Verdict(outcome="wrong", reason=f"{counts} columns, no word why")
    return Verdict(outcome="right")


def _same(column: Column, other: Column) -> bool:
    return column.words == other.words and np.array_equal(column.values, other.values, equal_nan=True)


def _is_shorter(original: MeasuredFile, path: Path) -> bool:
    """Whether bytes are lost, so that whole columns may be missing."""
    return path.stat().st_size < original.path.stat().st_size


def _numbers_in(data: bytes) -> NDArray[np.float64]:
    """All numbers that the bytes can represent as text or binary, also in compressed parts; sorted."""
    parts = [data, *_inflated(data)]
    numbers_read = [np.zeros(1)]
    for part in parts:
        text = part.decode("latin-1")
        numbers = [token.replace(",", ".").replace("D", "E").replace("d", "e") for token in NUMBER.findall(text)]
        numbers += [token for field in re.findall(r"[\d.eE+-]+", text) for token in [field] if _is_number(token)]
        numbers += re.findall(r"(?<=\d)\.\d+(?:[eE][+-]?\d+)?", text)
        short = re.findall(r"([+-]?\d*\.?\d+)([+-]\d{2,3})(?!\d)", text)  # FORTRAN: 1.5-04
        numbers += [f"{digits}e{exponent}" for digits, exponent in short]
        pairs = re.findall(r"(?=(?<!\d)([+-]?\d+),(\d+(?:[eE][+-]?\d+)?))", text)
        numbers += [f"{whole}.{rest}" for whole, rest in pairs]
        widths = [text[start : start + width].strip() for width in (13, 20) for start in range(len(text) - width + 1)]
        numbers += [field for field in widths if _is_number(field)] if len(text) < 20_000 else []
        numbers_read.append(np.array([float(number) for number in numbers if _is_number(number)]))
        for offset in range(8):
            for kind in KINDS:
                size = np.dtype(kind).itemsize
                if offset < size and len(part) - offset >= size:
                    count = (len(part) - offset) // size
                    with np.errstate(invalid="ignore"):
                        numbers_read.append(np.frombuffer(part, kind, count, offset).astype(np.float64))
    return np.unique(np.concatenate(numbers_read))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _inflated(data: bytes) -> Iterator[bytes]:
    """Decompressed parts of the bytes, as far as they can be decompressed."""
    for match in re.finditer(rb"\x78[\x01\x5e\x9c\xda]", data):
        try:
            yield zlib.decompressobj().decompress(data[match.start() :], 1_000_000)
        except zlib.error:
            continue
    if data.startswith(b"\x1f\x8b"):
        try:
            yield gzip.decompress(data)
        except (OSError, EOFError, zlib.error):
            return


def _is_in_file(column: Column, pool: NDArray[np.float64], is_abscissa: bool) -> bool:
    values = column.values
    parts = np.concatenate([values.real, values.imag]) if np.iscomplexobj(values) else values
    parts = parts[np.isfinite(parts)]
    if np.isin(parts, pool).all():
        return True
    if not is_abscissa or len(values) < 2:
        return False
    step = np.diff(values)
    finite = pool[np.isfinite(pool) & (pool != 0)]
    with np.errstate(all="ignore"):
        steps = np.concatenate([finite, 1.0 / finite])
        even = np.allclose(step, step[0], rtol=1e-6, atol=1e-9 * np.abs(values).max())
        return bool(even and np.isin(values[0], pool) and np.isclose(steps, step[0], rtol=1e-6, atol=0).any())


def run(count: int, folder: Path, keep: Path | None = None) -> Counter[tuple[str, str]]:
    """Damage and read the samples in turn.

    Parameters
    ----------
    count
        Number of damaged files.
    folder
        Folder of the samples and of the damaged file.
    keep
        Folder for files with a wrong outcome.

    Returns
    -------
    Number of files by sample and outcome.
    """
    originals = {path: read_file(path) for path in write_samples(folder)}
    (folder / "damaged").mkdir(exist_ok=True)
    outcomes: Counter[tuple[str, str]] = Counter()
    for number in range(count):
        path = list(originals)[number % len(originals)]
        damaged = folder / "damaged" / path.name
        damaged.write_bytes(mutate(path.read_bytes(), np.random.default_rng([SEED, number])))
        sys.stderr.flush()
        verdict = judge(originals[path], damaged)
        outcomes[path.name, verdict.outcome] += 1
        if verdict.outcome == "wrong":
            print(f"{number} {path.name}: {verdict.reason}")
            if keep is not None:
                keep.mkdir(exist_ok=True)
                (keep / f"{number}_{path.name}").write_bytes(damaged.read_bytes())
    return outcomes


def main() -> int:
    """Print the table of outcomes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        outcomes = run(given.count, Path(folder), given.keep)
    for name in sorted({name for name, _ in outcomes}):
        counts = (f"{word:>10s} {outcomes[name, word]:5d}" for word in ("right", "sentence", "wrong"))
        print(f"{name:16s}{''.join(counts)}")
    wrong = sum(number for (_, word), number in outcomes.items() if word == "wrong")
    print(f"{given.count} files, {wrong} wrong, {time.process_time() - start:.0f} CPU s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
