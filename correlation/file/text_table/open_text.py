"""Opening of text files in any common encoding, also with gzip."""

import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

from correlation.errors import CampaignError

GZIP = b"\x1f\x8b"
BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


@contextmanager
def open_text(path: Path) -> Iterator[IO[str]]:
    """Open a text file as a stream; bytes that are not UTF-8 become surrogates, see `clean`.

    Raises
    ------
    CampaignError
        The file cannot be read, or its compressed content is damaged.
    """
    try:
        with path.open("rb") as raw:
            compressed = raw.read(2) == GZIP
            raw.seek(0)
            stream = cast("IO[bytes]", gzip.GzipFile(fileobj=raw) if compressed else raw)
            buffered = io.BufferedReader(cast("io.RawIOBase", stream)) if compressed else stream
            mark = cast("io.BufferedReader", buffered).peek(3)[:3]
            encoding = next((name for start, name in BYTE_ORDER_MARKS.items() if mark.startswith(start)), "utf-8")
            errors = "strict" if encoding == "utf-16" else "surrogateescape"
            yield io.TextIOWrapper(buffered, encoding=encoding, errors=errors)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise CampaignError(f"{path.name}: its compressed content is damaged ({error}); copy it again") from None
    except UnicodeError:
        raise CampaignError(f"{path.name}: is not text in UTF-16 although it begins so; save it in UTF-8") from None
    except OSError as error:
        raise CampaignError(f"{path.name}: cannot be read ({error.strerror or error})") from None


def clean(text: str) -> str:
    """Decode text with bytes that are not UTF-8 as Latin-1, such as "m/s²" of an old program."""
    return text.encode("utf-8", "surrogateescape").decode("latin-1") if not text.isprintable() else text
