"""A format of test files from outside: a line of names as text, then their values in double precision."""

from pathlib import Path

import numpy as np

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat

MARK = b"BENCH "


def read(path: Path) -> MeasuredFile:
    header, _, values = path.read_bytes().partition(b"\n")
    names = header.removeprefix(MARK).decode("utf-8", "replace").split()
    if not names or len(values) % (8 * len(names)):
        raise CampaignError(f"{path.name}: {len(values)} bytes are no rows of {len(names)} channels: copy it again")
    table = np.frombuffer(values, "<f8").reshape(-1, len(names))
    columns = tuple(Column(name=name, values=table[:, number]) for number, name in enumerate(names))
    return MeasuredFile(path=path, format="bench", columns=columns)


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="bench",
        holds="a file of the bench (.bench)",
        suffixes=(".bench",),
        recognise=lambda head: head.startswith(MARK),
        read=read,
    )
)
