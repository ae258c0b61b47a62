"""WAV files: time histories of channels with a common sampling rate."""

import warnings
from pathlib import Path

import numpy as np

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from geometry.trial_process import read_in_trial_process

#: Lowest reading speed on any machine [byte/s], and memory for each byte of the file [-].
SPEED, MEMORY = 5e6, 20
#: Fact of a channel: the type of its numbers.
STORED_AS = "stored as"


def recognise(head: bytes) -> bool:
    """Whether a file has the header of a WAV file."""
    return head[:4] in {b"RIFF", b"RIFX", b"RF64"} and head[8:12] == b"WAVE"


def read(path: Path) -> MeasuredFile:
    """Read time and channels; whole numbers remain counts of the converter, whose scale is not in the file."""
    from scipy.io import wavfile

    # SciPy allocates memory for all samples stated in the header, even if the file has fewer.
    if defect := read_in_trial_process(lambda: wavfile.read(path), path, speed=SPEED, memory=MEMORY):
        raise CampaignError(f"{path.name}: is a damaged or cut WAV file (it {defect}); copy it again")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", wavfile.WavFileWarning)
            warnings.filterwarnings("ignore", "Chunk .non-data. not understood", wavfile.WavFileWarning)
            rate, samples = wavfile.read(path)
    except Exception as error:  # The library fails on damaged files in many ways.
        reason = "it has no samples" if isinstance(error, UnboundLocalError) else " ".join(str(error).split())[:200]
        raise CampaignError(f"{path.name}: is a damaged or cut WAV file ({reason}); copy it again") from None
    if rate <= 0 or not samples.size:
        raise CampaignError(f"{path.name}: has {len(samples)} samples at {rate} Hz; record it again")
    table = samples.reshape(len(samples), -1)
    facts = {"sampling rate": f"{rate} Hz", STORED_AS: str(samples.dtype)}
    time = Column(name="time", values=np.arange(len(table)) / rate, unit="s", function="time", facts=facts)
    if table.dtype.kind == "f" and not np.isfinite(table).all():
        raise CampaignError(f"{path.name}: has samples that are not finite numbers; record or copy it again")
    channels = (
        Column(
            name=f"channel {number + 1}", values=table[:, number].astype(np.float64), abscissa="time", function="time",
            facts=facts, where=f"channel {number + 1}",
        )
        for number in range(table.shape[1])
    )  # fmt: skip
    return MeasuredFile(path=path, format="wav", columns=(time, *channels), facts=facts)


def holds_counts(column: Column) -> bool:
    """Whether a column has whole numbers of a converter, whose scale is not in the file."""
    return not column.unit and column.facts.get(STORED_AS, "").startswith(("int", "uint"))


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="wav", holds="a WAV file (.wav)", suffixes=(".wav", ".wave"), recognise=recognise, read=read
    )
)
