"""A reduced assembly as a file: HDF5, one group a body; the layout stands in `docs/rom_file.md`."""

from pathlib import Path
from typing import TYPE_CHECKING

from reduction.assembly import ReducedAssembly
from reduction.file.model_envelope import Damaged, ModelFile
from reduction.file.rom_hdf5 import read_rom, write_rom

if TYPE_CHECKING:
    import h5py

FILE = ModelFile(format="stickslip reduced assembly", version=1, what="reduced assembly", writer="save_assembly")


def save_assembly(assembly: ReducedAssembly, path: Path | str) -> None:
    """Write a reduced assembly; a file of that name is replaced in one step, or left as it was if anything fails.

    Parameters
    ----------
    assembly
        The model.
    path
        The file; its folder must exist.

    Raises
    ------
    RomError
        The folder does not exist, or the file cannot be written.
    """

    def fill(file: "h5py.File") -> None:
        bodies = file.create_group("bodies")
        bodies.attrs["number"] = len(assembly.bodies)
        for number, (name, rom) in enumerate(assembly.bodies.items()):
            group = bodies.create_group(f"{number:06d}")
            group.attrs["name"] = name
            write_rom(rom, group)

    FILE.save(path, fill)


def load_assembly(path: Path | str) -> ReducedAssembly:
    """Read a reduced assembly that `save_assembly` wrote.

    Raises
    ------
    RomError
        The file is missing, is no reduced assembly, has another format version, is cut short or damaged, or a
        body holds what `reduction.file.rom_check` refuses.
    """

    def read(file: "h5py.File") -> ReducedAssembly:
        bodies = [group for _, group in sorted(file["bodies"].items())]
        if len(bodies) != file["bodies"].attrs["number"]:
            raise Damaged
        named = {str(group.attrs["name"]): group for group in bodies}
        return ReducedAssembly(
            bodies={name: read_rom(group, f'"{path}", body "{name}"') for name, group in named.items()}
        )

    return FILE.load(path, read)
