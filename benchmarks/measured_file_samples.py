"""Small test files of every format, for the benchmark and the tests of mutated files."""

import gzip
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io
from nptdms import ChannelObject, RootObject, TdmsWriter
from numpy.typing import NDArray
from scipy.io import wavfile

from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff

SEED = 27


def write_samples(folder: Path) -> list[Path]:
    """Write the sample files; returns their paths."""
    rng = np.random.default_rng(SEED)
    frequency = 100.0 + 0.5 * np.arange(20)
    response = 1.0 / (110.0**2 - frequency**2 + 2j * frequency) + 1e-5 * rng.normal(size=20)
    _write_text(folder, frequency, response)
    _write_universal(folder, frequency, response)
    _write_arrays(folder, frequency, response)
    wavfile.write(folder / "sound.wav", 1000, rng.integers(-3000, 3000, (40, 2), dtype=np.int16))
    wavfile.write(folder / "float.wav", 2000, rng.normal(size=40).astype(np.float32))
    with TdmsWriter(folder / "labview.tdms") as writer:
        sampling = {"wf_increment": 0.01, "unit_string": "g"}
        writer.write_segment(
            [
                RootObject({"title": "run 1"}),
                ChannelObject("run", "acc", rng.normal(size=30), sampling),
                ChannelObject("run", "force", rng.normal(size=30).astype(np.float32), {"wf_increment": 0.01}),
                ChannelObject("run", "count", np.arange(12, dtype=np.int32)),
            ]
        )
    return sorted(path for path in folder.iterdir() if path.is_file())


def _write_text(folder: Path, frequency: NDArray[Any], response: NDArray[Any]) -> None:
    rows = [f"{f:.2f},{x.real:.6e},{x.imag:.6e}" for f, x in zip(frequency, response, strict=True)]
    plain = "\n".join(["frequency [Hz],real [m/N],imag [m/N]", *rows]) + "\n"
    (folder / "comma.csv").write_text(plain)
    (folder / "packed.csv.gz").write_bytes(gzip.compress(plain.encode(), mtime=0))
    semicolons = [row.replace(",", ";").replace(".", ",") for row in rows]
    (folder / "german.csv").write_text("\r\n".join(["Frequenz;Re;Im", "Hz;mm/N;mm/N", *semicolons]) + "\r\n")
    words = [f"up\t{row}".replace(",", "\t") for row in rows] + [f"down\t{row}".replace(",", "\t") for row in rows]
    (folder / "tidy.tsv").write_text("\n".join(["# beam, level 1 N", "sweep\tf\tre\tim", *words]))
    (folder / "labview.lvm").write_text(_labview_text(response))


def _labview_text(response: NDArray[Any]) -> str:
    """Two channels with the time that their header states."""
    end = "***End_of_Header***\t"
    file = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.", end, ""]
    of_channels = ["Channels\t2", "Samples\t20\t20", "Y_Unit_Label\tm/s^2\tN", "X_Dimension\tTime\tTime"]
    rows = [f"\t{x.real:.6e}\t{x.imag:.6e}" for x in response]
    steps = ["X0\t0.0\t0.0", "Delta_X\t0.001\t0.001", end, "X_Value\tacc\tforce\tComment"]
    return "\n".join([*file, *of_channels, *steps, *rows]) + "\n"


def _write_universal(folder: Path, frequency: NDArray[Any], response: NDArray[Any]) -> None:
    columns = (
        Column(name="frequency", values=frequency, unit="Hz"),
        Column(
            name="H", values=response, unit="m/s^2/N", abscissa="frequency", function="frequency response",
            response=Point(node=2, direction="+z"), reference=Point(node=1, direction="+z"),
        ),
        Column(name="c", values=0.9 + 0.001 * frequency / 100, abscissa="frequency", function="coherence"),
    )  # fmt: skip
    nodes = {1: np.array([0.0, 0.0, 0.1]), 2: np.array([0.5, 0.0, 0.1])}
    measured = MeasuredFile(path=folder / "beam.uff", format="uff", title="beam", columns=columns, nodes=nodes)
    write_uff(measured, folder / "text.uff")
    write_uff(measured, folder / "binary.uff", binary=True)
    uneven = [Column(name="frequency", values=frequency**1.1, unit="Hz"), *columns[1:]]
    write_uff(MeasuredFile(path=folder / "u", format="uff", columns=tuple(uneven)), folder / "uneven.uff")
    (folder / "shapes.unv").write_bytes((folder / "text.uff").read_bytes() + shape_dataset())
    values = np.stack([response.real, response.imag], axis=1).astype(">f4").tobytes()
    head = (folder / "binary.uff").read_bytes().split(b"    58b")[0].rsplit(b"    -1\n", 1)[0]
    (folder / "big_endian.uff").write_bytes(head + single_precision_dataset(len(frequency), values))


def shape_dataset() -> bytes:
    """Dataset 55 with one complex mode at two nodes."""
    lines = ["    -1", "    55", "mode", "NONE", "NONE", "NONE", "NONE"]
    lines += ["".join(f"{one:10d}" for one in row) for row in ((1, 3, 2, 8, 5, 3), (2, 6, 1, 1))]
    lines.append("".join(f"{one:13.5E}" for one in (-3.0, 600.0, 0.0, 0.0, 0.0, 0.0)))
    for node in (1, 2):
        lines += [f"{node:10d}", "".join(f"{0.1 * node * one:13.5E}" for one in (1, 2, 3, 4, 5, 6))]
    return ("\n".join([*lines, "    -1"]) + "\n").encode()


def single_precision_dataset(count: int, values: bytes) -> bytes:
    """Dataset 58b of complex values in single precision, big endian, over even frequencies."""
    lines = [
        "    -1",
        f"    58b{2:6d}{2:6d}{11:12d}{len(values):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        *["NONE"] * 5,
        f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{2:10d}{3:4d} {'NONE':10s}{1:10d}{3:4d}",
        f"{5:10d}{count:10d}{1:10d}{100.0:13.5E}{0.5:13.5E}{0.0:13.5E}",
        *[f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}" for kind in (18, 12, 13, 0)],
    ]
    return ("\n".join(lines) + "\n").encode() + values + b"    -1\n"


def _write_arrays(folder: Path, frequency: NDArray[Any], response: NDArray[Any]) -> None:
    cell = np.empty((1, 2), dtype=object)
    cell[0, 0] = {"freq": frequency, "H": np.stack([response, 2 * response], axis=1)}
    cell[0, 1] = "remark"
    content = {"FRF": cell, "level": 1.5, "x": frequency, "name": "beam", "empty": np.zeros((0, 3))}
    scipy.io.savemat(folder / "plain.mat", content)
    scipy.io.savemat(folder / "packed.mat", content, do_compression=True)
    with h5py.File(folder / "tree.h5", "w", libver="latest") as file:
        file.attrs["title"] = "beam"
        group = file.create_group("run")
        group.create_dataset("acc", data=np.stack([response.real, response.imag])).attrs["unit"] = "m/s^2"
        group.create_dataset("H", data=response, chunks=(10,), compression="gzip", fletcher32=True)
        group["sweep"] = ["up", "down", "up"]
    with h5py.File(folder / "new.mat", "w", userblock_size=512) as file:
        _write_matlab_73(file, frequency, response)
    with (folder / "new.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")


def _write_matlab_73(file: Any, frequency: NDArray[Any], response: NDArray[Any]) -> None:
    """Write as MATLAB does: transposed arrays, texts as character codes, cells as references."""
    hidden = file.create_group("#refs#")
    structure = hidden.create_group("a")
    structure.attrs["MATLAB_class"] = np.bytes_(b"struct")
    pairs = np.stack([response.real, response.imag], axis=1).reshape(1, -1, 2)
    kind = np.dtype([("real", "f8"), ("imag", "f8")])
    fields = {"freq": frequency[None, :], "H": pairs.copy().view(kind)[..., 0]}
    for name, values in fields.items():
        structure.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_(b"double")
    remark = hidden.create_dataset("b", data=np.array([[ord(letter)] for letter in "remark"], dtype=np.uint16))
    remark.attrs["MATLAB_class"] = np.bytes_(b"char")
    cell = file.create_dataset("FRF", data=np.array([[structure.ref], [remark.ref]], dtype=h5py.ref_dtype))
    cell.attrs["MATLAB_class"] = np.bytes_(b"cell")
    file.create_dataset("x", data=frequency[None, :]).attrs["MATLAB_class"] = np.bytes_(b"double")
