"""STEP files: the solid and the names of its faces survive, and what cannot be written or read is said."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from geometry.blade import Blade
from geometry.blade_solid import blade_part
from geometry.errors import InputError
from geometry.part import Part
from geometry.plain_blade import PlainBlade, plain_blade_part
from geometry.step_io import write_step
from geometry.step_part import read_body


@pytest.fixture(scope="module")
def part() -> Part:
    return blade_part(Blade())


def test_volume_and_place_survive_the_round_trip(part: Part, tmp_path: Path) -> None:
    path = tmp_path / "new folder" / "blade.step"
    write_step(part, path)
    back = Part(name="back", solid=read_body(path).solid)
    # STEP holds 15 to 17 digits of each coordinate.
    np.testing.assert_allclose(back.volume, part.volume, rtol=1e-9)
    # Boxes are widened by the kernel's tolerance, 1e-7 mm.
    np.testing.assert_allclose(back.bounding_box, part.bounding_box, atol=2e-10)
    assert back.solid.isValid()


def test_the_file_names_the_faces(part: Part, tmp_path: Path) -> None:
    import cadquery as cq

    path = tmp_path / "blade.step"
    write_step(part, path)
    # Another reader of the same kernel, which looks at names, is the witness.
    read = cq.Assembly.importStep(str(path))
    area: defaultdict[str, float] = defaultdict(float)
    for node in read.objects.values():
        for face, name in node._subshape_names.items():
            area[name] += face.Area()
    assert area.keys() == part.faces.keys()
    for name, region in part.faces.items():
        np.testing.assert_allclose(1e-6 * area[name], region.area, rtol=1e-7)  # the kernel's fixed quadrature


def test_lengths_are_declared_in_millimetres(part: Part, tmp_path: Path) -> None:
    path = tmp_path / "blade.step"
    write_step(part, path)
    assert "SI_UNIT(.MILLI.,.METRE.)" in path.read_text()


def test_an_existing_file_is_replaced_and_nothing_else_is_left(part: Part, tmp_path: Path) -> None:
    path = tmp_path / "blade.step"
    path.write_text("old")
    write_step(part, path)
    assert path.read_text().startswith("ISO-10303-21;")
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_cannot_be_written_is_named_and_the_old_file_kept(tmp_path: Path) -> None:
    plain = plain_blade_part(PlainBlade())
    (tmp_path / "occupied").write_text("a file, not a folder")
    with pytest.raises(InputError, match=r"occupied/blade\.step cannot be written \(.*\): give a path in a folder"):
        write_step(plain, tmp_path / "occupied" / "blade.step")
    assert [entry.name for entry in tmp_path.iterdir()] == ["occupied"]


def test_a_folder_in_the_place_of_the_file_is_refused_and_no_partial_file_left(tmp_path: Path) -> None:
    plain = plain_blade_part(PlainBlade())
    (tmp_path / "blade.step").mkdir()
    with pytest.raises(InputError, match=r"blade\.step cannot be written \(Is a directory\)"):
        write_step(plain, tmp_path / "blade.step")
    assert [entry.name for entry in tmp_path.iterdir()] == ["blade.step"]


def test_a_kernel_that_cannot_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from cadquery.occ_impl.exporters import assembly

    monkeypatch.setattr(assembly, "exportAssembly", lambda *_: False)
    path = tmp_path / "blade.step"
    path.write_text("old")
    with pytest.raises(InputError, match=r"blade\.step could not be written"):
        write_step(plain_blade_part(PlainBlade()), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.step cannot be read \(No such file or directory\)"):
        read_body(tmp_path / "nowhere.step")


def test_a_file_cut_short_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "plain.step"
    write_step(plain_blade_part(PlainBlade()), path)
    whole = path.read_text()
    path.write_text(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"plain\.step is not a complete STEP file"):
        read_body(path)


def test_a_file_of_two_bodies_is_refused_with_their_number(tmp_path: Path) -> None:
    import cadquery as cq

    solid = plain_blade_part(PlainBlade()).solid
    cq.Compound.makeCompound([solid, solid.translate(cq.Vector(1e3, 0, 0))]).exportStep(str(tmp_path / "two.step"))
    with pytest.raises(InputError, match=r"two\.step holds 2 solids"):
        read_body(tmp_path / "two.step")
