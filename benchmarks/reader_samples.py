"""Small valid files of every format that the program reads, and the functions that read them.

Samples of measured files are in `benchmarks.measured_file_samples`.
"""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

SEED = 33
#: Mass and stiffness of five degrees of freedom.
MASS = np.diag(1.0 + np.arange(5.0))
STIFFNESS = 1e4 * (3 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))


class NeverRaised(Exception):
    """Placeholder for formats without their own exception."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Sample of a format.

    Parameters
    ----------
    file
        Name of the file.
    write
        Function that writes the file and the files that it needs.
    read
        Function that reads the file.
    announces
        Whether a file of this format states its size, so that a cut file is recognised.
    has_checksum
        Whether the file has a checksum, so that only the written data may be read.
    refusal
        Exception that the reader may raise besides an `InputError`.
    """

    file: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    announces: bool = False
    has_checksum: bool = False
    refusal: type[Exception] = NeverRaised


def samples() -> dict[str, Sample]:
    """All formats by name."""
    return {**_cases(), **_matrices(), **_meshes(), **_structures(), **_results(), **_measured(), **_stored()}


def _copy(*names: str) -> Callable[[Path], object]:
    root = Path(__file__).parents[1]

    def write(path: Path) -> None:
        for name in names:
            shutil.copy(root / name, path.parent / Path(name).name)

    return write


def _cases() -> dict[str, Sample]:
    def read(path: Path) -> object:
        from study.case.setup import read_case

        return len(read_case(path).model.sensors)

    def opened(path: Path) -> object:
        from study.kind.registry import open_case

        return open_case(path).title

    def study(path: Path) -> object:
        from casefile.table import load_case
        from study.table1.case import Table1Case

        return load_case(path, Table1Case).title

    cases = {
        "case of matrices": ("solve_chain.toml", read, ("solve_chain.toml", "solve_chain.npz")),
        "case of a beam": ("beam.toml", read, ("beam/beam.toml", "beam/beam.npz", "beam/beam_finer.toml",
                                               "beam/beam_finer.npz")),
        "case of a blade": ("blade.toml", opened, ("blade.toml",)),
        "case of a rig": ("rig.toml", opened, ("rig.toml",)),
        "case of limits": ("wedge_damper.toml", read, ("wedge_damper.toml", "wedge_damper.npz")),
    }  # fmt: skip
    result = {
        name: Sample(file=file, write=_copy(*(f"study/cases/{item}" for item in names)), read=reader)
        for name, (file, reader, names) in cases.items()
    }
    return {
        **result,
        "case of a part": Sample(file="screw.toml", write=_copy("examples/parts/screw.toml"), read=opened),
        "case of a mesh study": Sample(file="table1_rig.toml", write=_copy("study/cases/table1_rig.toml"), read=study),
        "campaign": Sample(file="campaign/campaign.toml", write=_write_campaign, read=_read_campaign),
        "campaign table": Sample(file="campaign/stepped.csv", write=_write_campaign, read=_read_campaign),
    }


def _read_campaign(path: Path) -> object:
    from correlation.campaign.read_campaign import read_campaign

    return read_campaign(path.parent).measurement


CAMPAIGN = """\
schema = 1
title = "Beam with a contact line"

[convention]
time = "exp(+i omega t)"
amplitude = "peak"

[units]
level = "N"
frequency = "Hz"

[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
uncertainty = "0.5 %"

[[test]]
name = "stepped"
configuration = "jointed"
file = "stepped.csv"

[[record]]
name = "ring-down"
file = "ring_down.csv"
units = { time = "ms", tip = "um" }

[held_out]
repeats = [3]
"""


def _write_campaign(path: Path) -> None:
    path.parent.mkdir(exist_ok=True)
    (path.parent / "campaign.toml").write_text(CAMPAIGN)
    rows = [
        f"stepped,{3 * repeat + k},{repeat},up,5.0,{470 + k}.0,tip,{harmonic},{24.1 - 3 * k},{-12.8 / harmonic},um"
        for repeat in (1, 2, 3)
        for k in range(3)
        for harmonic in (1, 3)
    ]
    head = "test,order,repeat,sweep,level,frequency,sensor,harmonic,real,imag,unit"
    (path.parent / "stepped.csv").write_text("\n".join([head, *rows]) + "\n")
    samples = [f"{0.05 * k},{20 * np.cos(3.0 * k) * np.exp(-0.05 * k):.6g}" for k in range(60)]
    (path.parent / "ring_down.csv").write_text("\n".join(["time,tip", *samples]) + "\n")


def _matrices() -> dict[str, Sample]:
    import scipy.io
    import scipy.sparse as sp

    from fe.file.dof_table import read_dof_table
    from fe.file.matrix_file import MatrixSource, read_matrix

    def read(path: Path) -> object:
        return read_matrix(MatrixSource(file=path)).matrix

    lower = sp.coo_array(sp.tril(STIFFNESS))
    entries = list(zip(lower.row + 1, lower.col + 1, lower.data, strict=True))
    text4 = ["       5       5       6       2K       1P,3E23.16"]
    for column in range(5):
        values = STIFFNESS[column:, column]
        text4 += [f"{column + 1:8d}{column + 1:8d}{2 * len(values):8d}"]
        numbers = [f"{value:23.16E}" for value in values]
        text4 += ["".join(numbers[k : k + 3]) for k in range(0, len(numbers), 3)]
    text4 += [f"{6:8d}{1:8d}{1:8d}", f"{1:23.16E}"]
    dmig = ["DMIG    KAAX    0       6       2       0                       5"]
    for row, column, value in entries:
        number = f"{value:.9E}".replace("E", "D")
        dmig += [f"DMIG*   KAAX    {column:16d}{1:16d}", f"*       {row:16d}{1:16d}{number:>16s}"]
    dofs = "dof,node,direction\n" + "".join(f"{k},{k + 1},x\n" for k in range(5))
    mapping = "Matrix Eqn  Node  Label\n" + "".join(f"{k + 1:8d}{k + 1:8d}  UX\n" for k in range(5))
    result = {
        "MatrixMarket": ("k.mtx", lambda path: scipy.io.mmwrite(path, sp.coo_array(STIFFNESS), symmetry="symmetric")),
        "MatrixMarket, dense": ("d.mtx", lambda path: scipy.io.mmwrite(path, STIFFNESS, symmetry="symmetric")),
        "Harwell-Boeing": ("k.hb", lambda path: scipy.io.hb_write(path, sp.csc_array(STIFFNESS))),
        "OUTPUT4": ("k.op4", lambda path: path.write_text("\n".join(text4) + "\n")),
        "OUTPUT4, binary": ("b.op4", lambda path: path.write_bytes(_binary_output4())),
        "sparse npz": ("k.npz", lambda path: sp.save_npz(path, sp.csr_array(STIFFNESS))),
    }
    plain = {
        "DMIG": ("k.pch", lambda path: path.write_text("\n".join(dmig) + "\n")),
        "CalculiX matrix": ("k.sti", lambda path: path.write_text("".join(f"{i} {j} {x}\n" for i, j, x in entries))),
    }
    tables = {"dofs.csv": dofs, "k.mapping": mapping, "k.dof": "".join(f"{k + 1}.1\n" for k in range(5))}
    return {
        **{name: Sample(file=file, write=write, read=read, announces=True) for name, (file, write) in result.items()},
        **{name: Sample(file=file, write=write, read=read) for name, (file, write) in plain.items()},
        **{
            f"table of rows, {Path(file).suffix}": Sample(
                file=file, write=lambda path, text=text: path.write_text(text), read=read_dof_table
            )
            for file, text in tables.items()
        },
    }


def _binary_output4() -> bytes:
    """Dense symmetric matrix in records with their length before and after them."""

    def record(content: bytes) -> bytes:
        length = np.int32(len(content)).tobytes()
        return length + content + length

    whole = record(np.array([5, 5, 6, 2], dtype="<i4").tobytes() + b"K       ")
    for column in range(5):
        values = STIFFNESS[column:, column]
        head = np.array([column + 1, column + 1, 2 * len(values)], dtype="<i4").tobytes()
        whole += record(head + values.astype("<f8").tobytes())
    return whole + record(np.array([6, 1, 2], dtype="<i4").tobytes() + np.array([1.0], dtype="<f8").tobytes())


def _meshes() -> dict[str, Sample]:
    import meshio

    from fe.file.mesh_file import read_mesh, write_mesh

    def mesh() -> Any:
        from fe.mesh import Mesh

        points = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0)])
        first = np.array([0, 1, 4, 3, 6, 7, 10, 9])
        return Mesh(
            points=points, cells={"hexahedron": np.stack([first, first + 1])},
            node_sets={"left": np.array([0, 3, 6, 9])}, face_sets={"right": np.array([[1, 1]])},
            cell_sets={"half": np.array([1])},
        )  # fmt: skip

    def msh2(path: Path) -> None:
        whole = mesh()
        meshio.gmsh.write(
            str(path), meshio.Mesh(whole.points, [("hexahedron", whole.cells["hexahedron"])]), "2.2", False
        )

    def bdf(path: Path) -> None:
        whole = mesh()
        lines = ["SOL 103", "CEND", "BEGIN BULK"]
        lines += [f"GRID,{k + 1},,{x},{y},{z}" for k, (x, y, z) in enumerate(whole.points)]
        for k, nodes in enumerate(whole.cells["hexahedron"] + 1):
            fields = [f"{value:8d}" for value in (k + 1, 7, *nodes)]
            lines += ["CHEXA   " + "".join(fields[:8]) + "+", "+       " + "".join(fields[8:])]
        lines += ["SET1,4,1,THRU,6,11", "SPC1,2,123,1,4", "PSOLID,7,1", "MAT1,1,2.1+11,,0.3,7800.", "ENDDATA"]
        path.write_text("\n".join(lines) + "\n")

    def read_with_material(path: Path) -> object:
        from fe.file.mesh import MESH_FORMATS

        (format_,) = (item for item in MESH_FORMATS if path.suffix in item.suffixes)
        if format_.materials is not None:
            format_.materials(path)
        return read_mesh(path)

    def deck(path: Path) -> None:
        write_mesh(mesh(), path)
        generated = "*NSET, NSET=all, GENERATE\n1, 12, 1\n*ELSET, ELSET=every, GENERATE\n1, 2\n"
        material = "*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7800.\n"
        section = "*SOLID SECTION, ELSET=half, MATERIAL=steel\n"
        path.write_text(path.read_text() + generated + material + section)

    def step(path: Path) -> None:
        import cadquery as cq

        cq.exporters.export(cq.Workplane().box(10, 20, 30).faces(">Z").hole(4), str(path))

    def read_step(path: Path) -> object:
        from geometry.step_part import read_body

        return len(read_body(path).faces)

    return {
        "INP": Sample(file="m.inp", write=deck, read=read_with_material),
        "MSH 4.1": Sample(file="m.msh", write=lambda path: write_mesh(mesh(), path), read=read_mesh, announces=True),
        "MSH 2.2": Sample(file="m2.msh", write=msh2, read=read_mesh, announces=True),
        "VTU": Sample(file="m.vtu", write=lambda path: write_mesh(mesh(), path), read=read_mesh, announces=True),
        "BDF": Sample(file="m.bdf", write=bdf, read=read_with_material),
        "STEP": Sample(file="box.step", write=step, read=read_step, announces=True),
    }


def rom() -> Any:
    """Reduced model of random matrices with a fixed seed."""
    from reduction.rom import ReducedModel

    rng = np.random.default_rng(SEED)
    roots = [rng.standard_normal((5, 5)) for _ in range(3)]
    return ReducedModel(
        **{name: root @ root.T + np.eye(5) for name, root in zip(("mass", "damping", "stiffness"), roots, strict=True)},
        boundary_node=np.array([3, 3, 1]),
        boundary_direction=np.array([1, 2, 1]),
        boundary_sets={"slot": np.array([2, 0])},
        fixed_interface_frequency=np.array([1.0, 3.0]),
        recovery=rng.standard_normal((9, 5)),
        free=np.arange(3, 12),
        n_node=4,
        provenance={"case": "[blade]"},
    )


def _structures() -> dict[str, Sample]:
    import scipy.io
    import scipy.sparse as sp

    from reduction.assembly import ReducedAssembly
    from reduction.file.rom_hdf5 import load_assembly, load_rom, save_assembly, save_rom
    from reduction.file.rom_npz import save_rom_npz
    from reduction.file.structure_file import load_matrices
    from reduction.joint_law.jenkins import JenkinsElement
    from reduction.jointed_system import JointedSystem
    from reduction.nlvib import load_nlvib, save_nlvib

    def nlvib(path: Path) -> None:
        pad = JenkinsElement(name="pad", direction=np.eye(5)[0], tangential_stiffness=3e4, limit_force=2.0)
        save_nlvib(JointedSystem(mass=MASS, damping=np.eye(5), stiffness=STIFFNESS, joints=[pad]), path)

    def mat(path: Path, **options: bool) -> None:
        scipy.io.savemat(path, {"M": sp.csc_array(MASS), "K": STIFFNESS, "note": "five"}, **options)

    def plain_npz(path: Path) -> None:
        np.savez(path, M=MASS, K=STIFFNESS, dof_direction=np.array(["x"] * 5), tip=np.eye(5)[4])
        path.with_suffix(".toml").write_text('schema = 2\n[structure]\nkind = "plain"\nfile = "s.npz"\n')

    def read_plain(path: Path) -> object:
        from study.case.setup import read_case

        return read_case(path.with_suffix(".toml")).structure.matrices.mass

    return {
        "npz of matrices": Sample(file="s.npz", write=plain_npz, read=read_plain, announces=True),
        "npz, compressed": Sample(
            file="c.npz", write=lambda path: np.savez_compressed(path, M=MASS, K=STIFFNESS), read=load_matrices,
            announces=True,
        ),
        "MAT of matrices": Sample(file="s.mat", write=mat, read=load_matrices, announces=True),
        "MAT, compressed": Sample(
            file="c.mat", write=lambda path: mat(path, do_compression=True), read=load_matrices, announces=True
        ),
        "MAT of NLvib": Sample(file="nlvib.mat", write=nlvib, read=load_nlvib, announces=True),
        "npz of a reduced model": Sample(
            file="rom.npz", write=lambda path: save_rom_npz(rom(), path), read=load_matrices, announces=True
        ),
        "HDF5 of a reduced model": Sample(
            file="rom.h5", write=lambda path: save_rom(rom(), path), read=load_rom, announces=True, has_checksum=True
        ),
        "HDF5 of an assembly": Sample(
            file="rig.h5", write=lambda path: save_assembly(ReducedAssembly(bodies={"a": rom(), "b": rom()}), path),
            read=load_assembly, announces=True, has_checksum=True,
        ),
    }  # fmt: skip


def _results() -> dict[str, Sample]:
    from hbsolve.continuation.branch import load_branch
    from hbsolve.limits.result import load_limits

    def system() -> Any:
        from hbsolve.balance import HarmonicBalance
        from reduction.joint_law.jenkins import JenkinsElement
        from reduction.jointed_system import JointedSystem

        pad = JenkinsElement(name="pad", direction=[0, 1], tangential_stiffness=3e4, limit_force=2.0)
        structure = JointedSystem(
            mass=np.eye(2), damping=4 * np.eye(2), stiffness=[[8e4, -4e4], [-4e4, 8e4]], joints=[pad],
            harmonic_force=[[0, 0], [10, 0]],
        )  # fmt: skip
        return HarmonicBalance(system=structure, n_harmonic=4)

    def branch(path: Path) -> None:
        from hbsolve.continuation.response import frequency_response

        frequency_response(system(), 150.0, 200.0, step=20.0).save(path)

    def limits(path: Path) -> None:
        from hbsolve.limits.objective import OutputHarmonic
        from hbsolve.limits.response_limits import limit_problem, response_limits
        from hbsolve.limits.search import LimitSettings

        problem = limit_problem(system(), OutputHarmonic(row=0))
        response_limits(problem, [190.0, 210.0], [1.0], settings=LimitSettings(sample=4, population=4)).save(path)

    return {
        "netCDF of a branch": Sample(file="branch.nc", write=branch, read=load_branch),
        "netCDF of limits": Sample(file="limits.nc", write=limits, read=load_limits),
    }


def _measured() -> dict[str, Sample]:
    """Measured files; `benchmarks.measured_file_mutants` checks their values."""
    from benchmarks.measured_file_samples import write_samples
    from correlation.file.read_file import read_file

    names = ("text.uff", "binary.uff", "shapes.unv", "plain.mat", "packed.mat", "tree.h5", "new.mat", "comma.csv",
             "packed.csv.gz", "tidy.tsv", "sound.wav", "labview.tdms")  # fmt: skip
    return {
        f"measured {name}": Sample(
            file=f"measured/{name}",
            write=lambda path: (path.parent.mkdir(exist_ok=True), write_samples(path.parent)),
            read=read_file,
        )
        for name in names
    }


def _stored() -> dict[str, Sample]:
    from pipeline.record import DamagedRecord, Record, read_record, write_record
    from study.diagnose.add import undo
    from study.diagnose.history import Errors, History, HistoryStep, history_of

    def record(path: Path) -> None:
        value = {"rom": rom(), "list": [1.5, (2, "x"), None], "array": np.arange(6.0)}
        write_record(path, Record(value=value, name="a stage", key="ab", seconds=1.5))

    def history(path: Path) -> None:
        case = path.with_name("solve_chain.toml")
        _copy("study/cases/solve_chain.toml", "study/cases/solve_chain.npz")(case)
        text = case.read_text()
        errors = Errors(training=0.1, held_out=0.2, training_chi2=1.0, held_out_chi2=2.0)
        steps = (
            HistoryStep(
                what="diagnosis", when="2026-01-01T00:00:00+00:00", case_key="ab", campaign="campaign", before=errors,
            ),
            HistoryStep(
                what="add", effect="mass at tip", values={"mass": [0.1, 0.01]}, case_before=text,
                case_after=text + "\n[calibrated]\nmu = 1.1\n", diff=("+mu = 1.1",), before=errors, after=errors,
            ),
        )  # fmt: skip
        History(file=path, steps=steps).save()
        case.write_text(text + "\n[calibrated]\nmu = 1.1\n")

    def read_history(path: Path) -> object:
        case = path.with_name("solve_chain.toml")
        before = case.read_text()
        steps = history_of(case).steps
        try:
            undo(case)
        finally:
            case.write_text(before)
        return steps

    return {
        "cache": Sample(
            file="record.npz", write=record, read=read_record, announces=True, has_checksum=True, refusal=DamagedRecord
        ),
        "history": Sample(file="solve_chain.history.json", write=history, read=read_history),
    }
