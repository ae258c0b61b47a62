"""Foreign STEP files: made by the kernel's own writer from plain primitives, by none of the builders here."""

from pathlib import Path

import cadquery as cq
import numpy as np
import pytest
from cadquery.occ_impl.exporters.assembly import exportAssembly

from geometry.errors import InputError, SelectorError
from geometry.face_selector import FaceSelector, select_faces
from geometry.part import Shape
from geometry.step_part import read_body, step_part


def block() -> Shape:
    """20 x 30 x 40 mm from the origin, with a bore of radius 5 mm along z."""
    return cq.Solid.makeBox(20, 30, 40).cut(cq.Solid.makeCylinder(5, 40, cq.Vector(10, 15, 0))).Solids()[0]


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The block with a name on one face and a colour on another."""
    solid = block()
    assembly = cq.Assembly(solid, name="anything")
    faces = cq.Workplane(solid)
    assembly.addSubshape(faces.faces("<Z").val(), name="foot")
    assembly.addSubshape(faces.faces(">Y").val(), color=cq.Color(0, 0, 1))
    path = tmp_path_factory.mktemp("step") / "bracket.step"
    exportAssembly(assembly, str(path))
    return path


def written(shape: Shape, path: Path) -> Path:
    cq.exporters.export(cq.Workplane(shape), str(path))
    return path


BORE = 2 * np.pi * 0.005 * 0.04
SELECTED = {
    "by name": (FaceSelector(name="foot"), 0.02 * 0.03 - np.pi * 0.005**2, (0.01, 0.015, 0)),
    "by colour": (FaceSelector(colour="#0000ff"), 0.02 * 0.04, (0.01, 0.03, 0.02)),
    "by place": (FaceSelector(at=(0.0, 0.001, 0.001)), 0.03 * 0.04, (0, 0.015, 0.02)),
    "by place on a curved face": (FaceSelector(at=(0.015, 0.015, 0.013)), BORE, (0.01, 0.015, 0.02)),
    "by normal": (FaceSelector(normal=(0, -2, 0)), 0.02 * 0.04, (0.01, 0, 0.02)),
    "by area": (FaceSelector(area=(1.25e-3, 1.26e-3)), BORE, (0.01, 0.015, 0.02)),
    "by two at once": (
        FaceSelector(area=(0.5e-3, 0.6e-3), normal=(0, 0, 1)),
        0.02 * 0.03 - np.pi * 0.005**2,
        (0.01, 0.015, 0.04),
    ),
}


@pytest.mark.parametrize("how", SELECTED)
def test_a_face_is_found(how: str, named: Path) -> None:
    selector, area, centre = SELECTED[how]
    part = step_part(named, {"chosen": [selector]})
    # The kernel's fixed quadrature on circles is right to nine digits.
    assert part.faces["chosen"].area == pytest.approx(area, rel=1e-8)
    np.testing.assert_allclose(part.faces["chosen"].centre, centre, atol=1e-9)
    assert part.name == "bracket"
    assert part.volume == pytest.approx(0.02 * 0.03 * 0.04 - np.pi * 0.005**2 * 0.04, rel=1e-9)


def test_several_selectors_make_one_region(named: Path) -> None:
    sides = [FaceSelector(normal=(1, 0, 0)), FaceSelector(normal=(-1, 0, 0))]
    part = step_part(named, {"sides": sides, "foot": [FaceSelector(name="foot")]})
    assert part.faces["sides"].area == pytest.approx(2 * 0.03 * 0.04, rel=1e-12)
    assert len(part.faces["sides"].faces) == 2


def test_a_file_in_inches_is_the_same_body(named: Path, tmp_path: Path) -> None:
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    before = Interface_Static.CVal_s("write.step.unit")
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "INCH")
    try:
        writer.Transfer(block().wrapped, STEPControl_AsIs)
        writer.Write(str(tmp_path / "inch.step"))
    finally:
        Interface_Static.SetCVal_s("write.step.unit", before)
    assert "INCH" in (tmp_path / "inch.step").read_text()
    assert step_part(tmp_path / "inch.step", {}).volume == pytest.approx(step_part(named, {}).volume, rel=1e-9)


def test_loose_faces_that_close_are_sewn_and_it_is_said(tmp_path: Path) -> None:
    path = written(cq.Compound.makeCompound(block().Faces()), tmp_path / "faces.step")
    body = read_body(path)
    assert body.healing == ("7 separate faces were sewn into a solid",)
    assert body.solid.Volume() == pytest.approx(20 * 30 * 40 - np.pi * 25 * 40, rel=1e-8)
    assert read_body(written(block(), tmp_path / "sound.step")).healing == ()


def test_an_open_surface_is_refused_with_the_place_of_a_gap(tmp_path: Path) -> None:
    faces = [face for face in cq.Solid.makeBox(20, 30, 40).Faces() if face.Center().z < 39]
    path = written(cq.Compound.makeCompound(faces), tmp_path / "open.step")
    with pytest.raises(
        InputError, match=r"open\.step holds an open surface, 4 edges .*one is at \(.*, 40\) mm\): close"
    ):
        read_body(path)


def test_solids_that_are_apart_are_not_intersected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an assembly of sixty parts that took so long that the file was called damaged."""

    def refuse(*_: object) -> None:
        raise AssertionError("two solids were intersected")

    monkeypatch.setattr(cq.Shape, "intersect", refuse)
    one = cq.Solid.makeBox(10, 10, 10)
    apart = written(cq.Compound.makeCompound([one, one.translate(cq.Vector(20, 0, 0))]), tmp_path / "apart.step")
    with pytest.raises(InputError, match="holds 2 solids: export only the intended body"):
        read_body(apart)


def test_several_solids_are_refused_and_their_overlap_is_told(tmp_path: Path) -> None:
    one = cq.Solid.makeBox(10, 10, 10)
    apart = written(cq.Compound.makeCompound([one, one.translate(cq.Vector(20, 0, 0))]), tmp_path / "apart.step")
    with pytest.raises(InputError, match=r"apart\.step holds 2 solids: export only the intended"):
        read_body(apart)
    over = written(cq.Compound.makeCompound([one, one.translate(cq.Vector(9, 0, 0))]), tmp_path / "over.step")
    with pytest.raises(InputError, match=r"over\.step holds 2 solids, of which number 1 and 2 overlap by 100 mm\^3"):
        read_body(over)


def test_what_is_no_step_file_is_refused(tmp_path: Path, named: Path) -> None:
    with pytest.raises(InputError, match=r"none\.step cannot be read \(No such file"):
        read_body(tmp_path / "none.step")
    (tmp_path / "text.step").write_text("solid ascii\nendsolid\n")
    with pytest.raises(InputError, match=r"text\.step is not a STEP file, which begins with"):
        read_body(tmp_path / "text.step")
    (tmp_path / "blank.step").write_text("\n")
    with pytest.raises(InputError, match=r"blank\.step is empty: export or copy it again"):
        read_body(tmp_path / "blank.step")
    (tmp_path / "cut.step").write_text(named.read_text()[:2000])
    with pytest.raises(InputError, match=r"cut\.step is not a complete STEP file"):
        read_body(tmp_path / "cut.step")
    empty = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    (tmp_path / "empty.step").write_text(empty)
    with pytest.raises(InputError, match=r"empty\.step is a STEP file without a readable body"):
        read_body(tmp_path / "empty.step")


def test_curves_alone_are_refused(tmp_path: Path) -> None:
    path = written(cq.Edge.makeCircle(5), tmp_path / "circle.step")
    with pytest.raises(InputError, match=r"circle\.step contains no faces"):
        read_body(path)


def test_a_selector_that_fits_nothing_shows_the_faces_there_are(named: Path) -> None:
    with pytest.raises(
        InputError, match=r'fits "clamp" \(name = fot\): the nearest is the plane .*; there are: .*"foot"'
    ) as refused:
        step_part(named, {"clamp": [FaceSelector(name="fot")]})
    assert "plane of 800 mm^2 around (10, 30, 20) mm #0000FF" in str(refused.value)
    assert "cylinder of 1257 mm^2 around (10, 15, 20) mm" in str(refused.value)


@pytest.mark.parametrize(
    ("selector", "said"),
    [
        (
            FaceSelector(normal=(0, 0.1, -1)),
            r"around \(10, 15, 0\) mm \"foot\", but its normal is \(0, 0, -1\), 5.71 deg",
        ),
        (FaceSelector(area=(1.3e-3, 1.4e-3)), r"cylinder of 1257 mm\^2 .*, but its area is 1256.64 mm\^2: give"),
        (FaceSelector(at=(0.01, 0.032, 0.02)), r"\(10, 30, 20\) mm #0000FF, but it is 2 mm from that point: give"),
        (FaceSelector(colour="#0000FF", normal=(1, 0, 0)), r"0000FF, but its normal is \(0, 1, 0\), 90 degrees off"),
    ],
)
def test_the_nearest_face_is_told_with_what_it_has(named: Path, selector: FaceSelector, said: str) -> None:
    with pytest.raises(SelectorError, match=said) as refused:
        step_part(named, {"clamp": [FaceSelector(name="foot"), selector]})
    assert (refused.value.region, refused.value.number) == ("clamp", 1)


def test_a_face_in_two_regions_is_refused(named: Path) -> None:
    both = {"clamp": [FaceSelector(normal=(0, 0, -1))], "foot": [FaceSelector(name="foot")]}
    with pytest.raises(InputError, match=r'plane of 521\.5 mm\^2 .* is in "clamp" and in "foot": say more'):
        select_faces("bracket.step", read_body(named).faces, both)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "has no selector"),
        ({"colour": "red"}, 'colour = "red" is not a colour'),
        ({"normal": (0, 0, 0)}, r"normal = \(0, 0, 0\) has no direction"),
        ({"area": (2.0, 1.0)}, r"area = \(2\.0, 1\.0\) m\^2 must be the smallest"),
    ],
)
def test_a_selector_that_means_nothing_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        FaceSelector(**given)  # type: ignore[arg-type]
