"""Process of `benchmarks.reader_mutants` that damages and reads files."""

import hashlib
import io
import json
import re
import sys
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measured_file_mutants import mutate
from benchmarks.reader_mutants import ASIDE, RESULT
from benchmarks.reader_samples import Sample, samples
from geometry.errors import InputError, InputWarning

SEED = 2033
#: Largest length of a message [characters].
LONGEST = 5000
#: Largest memory beyond that for the undamaged file [byte], and additional bytes for each byte of the damaged file [-].
MEMORY, PER_BYTE = 1 << 30, 20
NUMBER = re.compile(rb"[+-]?\d+(?:\.\d*)?(?:[eEdD][+-]?\d+)?")
#: Replacements of a number in a text.
NUMBERS = (
    b"0", b"-1", b"1", b"1.5", b"2000000000", b"-2147483648", b"9223372036854775808", b"9" * 5000, b"1e308",
    b"-1.7e308", b"5e-324", b"nan", b"inf", b"2E", b"", b'"', b"[" * 5000, b"../../../etc/passwd", b"true",
)  # fmt: skip
#: Replacements of bytes.
WORDS = tuple(np.array([value], dtype=kind).tobytes() for kind, values in (
    ("<i4", (-1, 0, 2**31 - 1, -(2**31), 10**9)), (">i4", (-1, 1, 2**31 - 1)), ("<i8", (-1, 0, 2**62, 2**40)),
    ("<f8", (np.nan, np.inf, 1e308, 5e-324)),
) for value in values)  # fmt: skip
OWN_FOLDERS = ("/dev/null", "/proc/")
FORBIDDEN = {"os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod",
             "subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "socket.connect"}  # fmt: skip


def damaged_bytes(sound: bytes, name: str, number: int) -> tuple[bytes, str]:
    """Damage the bytes of a file; returns them and the kind of damage.

    Kinds are "cut", "forged" (with valid checksums) and "damaged".

    Parameters
    ----------
    sound
        Bytes of the undamaged file.
    name, number
        Format and number of the damage, which are its seed.
    """
    rng = np.random.default_rng([SEED, zlib.crc32(name.encode()), number])
    match int(rng.integers(5)):
        case 0:
            return sound[: int(rng.integers(len(sound)))], "cut"
        case 1:
            return _with_other_numbers(sound, rng), "damaged"
        case 2:
            return _with_other_words(sound, rng), "damaged"
        case 3 if sound.startswith(b"PK"):
            return _with_damaged_member(sound, rng, with_checksum=_has_checksum(sound)), "forged"
    return mutate(sound, rng), "damaged"


def _with_other_numbers(sound: bytes, rng: np.random.Generator) -> bytes:
    places = list(NUMBER.finditer(sound))
    for _ in range(int(rng.integers(1, 3))):
        if places:
            place = places.pop(int(rng.integers(len(places))))
            sound = sound[: place.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + sound[place.end() :]
            places = [item for item in places if item.end() <= place.start()]
    return sound


def _with_other_words(sound: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(sound)
    for _ in range(int(rng.integers(1, 4))):
        word, place = WORDS[int(rng.integers(len(WORDS)))], int(rng.integers(len(damaged)))
        damaged[place : place + len(word)] = word[: len(damaged) - place]
    return bytes(damaged)


def _with_damaged_member(sound: bytes, rng: np.random.Generator, *, with_checksum: bool) -> bytes:
    """Archive with a damaged member and valid checksums."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(sound)) as whole, zipfile.ZipFile(stream, "w") as changed:
        chosen = int(rng.integers(len(whole.namelist())))
        for number, member in enumerate(whole.namelist()):
            content = whole.read(member)
            if number == chosen:
                change = (_with_other_numbers, _with_other_words, mutate)[int(rng.integers(3))]
                content = change(content, rng)
            changed.writestr(zipfile.ZipInfo(member), content)
        changed.comment = bytes(64) if with_checksum else b""
    if not with_checksum:
        return stream.getvalue()
    body = stream.getvalue()[:-64]
    return body + hashlib.sha256(body).hexdigest().encode()


def _has_checksum(sound: bytes) -> bool:
    return hashlib.sha256(sound[:-64]).hexdigest().encode() == sound[-64:]


class Watched:
    """Audit hook that records forbidden operations of the process on files and programs."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.found = str(folder.resolve()), ""
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = (*arguments, None, None)[:3]
            writes = (isinstance(mode, str) and set(mode) & set("wax+")) or (isinstance(flags, int) and flags & 0o1103)
            if writes and not isinstance(path, int) and not self._is_own(str(path)):
                self.found = f"{event} {path}"
        elif event in FORBIDDEN and not (arguments and self._is_own(str(arguments[0]))):
            self.found = f"{event} {arguments}"[:200]

    def _is_own(self, path: str) -> bool:
        whole = str(Path(path).absolute())
        return whole.startswith((self.folder, *OWN_FOLDERS)) or "stickslip/compiled" in whole


def judge(sample: Sample, path: Path, sound: str, *, done: str) -> tuple[str, str]:
    """Read a damaged file; returns outcome and reason."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = sample.read(path)
        except (InputError, sample.refusal) as error:
            message = str(error)
            lines_are_short = all(line.isprintable() for line in message.split("\n"))
            if not message.strip() or len(message) > LONGEST or not lines_are_short:
                return "wrong", f"no sentence: {message[:300]!r}"
            return "sentence", message
        except BaseException as error:
            return "wrong", f"{type(error).__name__}: {error}"
    if noise := [str(item.message) for item in caught if not issubclass(item.category, InputWarning)]:
        return "wrong", f"warning of Python: {noise[0]}"
    must_be_whole = (sample.has_checksum and done != "forged") or (sample.announces and done == "cut")
    if must_be_whole and digest(result) != sound:
        return "wrong", "other values were read than were written"
    return "right", ""


def digest(value: Any) -> str:
    """Hash of the data that were read."""
    from pipeline.fingerprint import make_canonical

    try:
        content = json.dumps(make_canonical(value), sort_keys=True)
    except TypeError:
        content = repr(value)
    return hashlib.sha256(content.encode()).hexdigest()


def main() -> None:
    """Damage and read files number FIRST to LAST - 1 of a format; print each outcome on a line."""
    name, folder, first, last = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    sample = samples()[name]
    path = folder / sample.file
    path.parent.mkdir(parents=True, exist_ok=True)
    sample.write(path)
    whole, sound = path.read_bytes(), digest(sample.read(path))
    peak = _peak_memory()
    watched = Watched(folder)
    _tell(0, "ready", "")
    for number in range(first, last):
        damaged, done = damaged_bytes(whole, name, number)
        path.write_bytes(damaged)
        watched.found = ""
        outcome, reason = judge(sample, path, sound, done=done)
        if watched.found:
            outcome, reason = "outside", watched.found
        more = _peak_memory() - peak - PER_BYTE * len(damaged)
        if more > MEMORY:
            outcome, reason = "memory", f"{more / 1e9:.1f} GB; {outcome}: {reason}"
        if outcome not in {"right", "sentence"}:
            path.with_name(f"{ASIDE}{number}").write_bytes(damaged)
        _tell(number, outcome, reason)
        if outcome == "memory":
            _tell(0, "again", "")
            return


def _peak_memory() -> int:
    text = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024 * int(text.partition("VmPeak:")[2].split()[0])


def _tell(number: int, outcome: str, reason: str) -> None:
    print(RESULT + json.dumps([number, outcome, reason[:600]]), flush=True)


if __name__ == "__main__":
    main()
