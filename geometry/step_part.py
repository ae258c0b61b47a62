"""Read a user's STEP file as a part: one valid solid, repaired if that is safe, with faces selected by the user."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import InputError
from geometry.face_selector import FaceSelector, KnownFace, select_faces
from geometry.part import Part, Shape
from geometry.step_io import check_complete
from geometry.trial_process import read_in_trial_process

#: Largest gap between faces that is closed automatically [mm]: above the gaps of CAD programs, below any feature.
SEWN = 1e-2
#: Reading speed of the CAD kernel for a STEP file on a slow machine [byte/s], and memory per byte of the file [-].
SPEED, MEMORY = 20e3, 500


@dataclass(frozen=True, kw_only=True, eq=False)
class StepBody:
    """Solid of a STEP file.

    Parameters
    ----------
    solid
        CadQuery solid, in millimetres.
    faces
        Faces of the solid with their names and colours.
    healing
        Clauses about repairs; empty if the file was valid.
    """

    solid: Shape
    faces: tuple[KnownFace, ...]
    healing: tuple[str, ...] = ()


def step_part(
    path: Path,
    faces: Mapping[str, Sequence[FaceSelector]],
    points: Mapping[str, Float[NDArray[np.float64], " 3"]] | None = None,
) -> Part:
    """Read a STEP file as a part with the name of the file.

    Parameters
    ----------
    path
        STEP file.
    faces
        Selectors by the name of a region.
    points
        Named points on the surface [m].

    Raises
    ------
    InputError
        As in `read_body` and `select_faces`.
    """
    body = read_body(path)
    regions = select_faces(str(path), body.faces, faces)
    return Part(name=Path(path).stem, solid=body.solid, faces=regions, points=points or {})


def read_body(path: Path) -> StepBody:
    """Read the only solid of a STEP file, and repair it if its shape does not change.

    Faces with gaps of at most 0.01 mm are sewn to a solid.

    Raises
    ------
    InputError
        The file is missing, is not a complete STEP file, or has no body; an open surface (the message locates a gap);
        several solids (the message names an overlap); or an invalid solid.
    """
    import cadquery  # noqa: F401  # imported before the process forks

    path = Path(path)
    check_complete(path)
    if defect := read_in_trial_process(lambda: _read_body(path), path, speed=SPEED, memory=MEMORY):
        raise InputError(f"{path} is damaged, it {defect}: export it again")
    return _read_body(path)


def _read_body(path: Path) -> StepBody:
    import cadquery as cq
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.TransferRoots() or reader.OneShape().IsNull():
        raise InputError(f"{path} is a STEP file without a readable body: export it again")
    shape = cq.Shape.cast(reader.OneShape())
    original = shape.Faces()
    known = list(zip(face_names(reader, original), face_colours(reader, original), strict=True))
    attributes = dict(zip(original, known, strict=True))
    solids, healing = shape.Solids(), []
    if len(solids) > 1:
        raise InputError(f"{path} holds {len(solids)} solids{_overlap(solids)}: export only the intended body")
    if solids:
        solid: Shape = solids[0]
        kept = {face: attributes[face] for face in solid.Faces() if face in attributes}
    else:
        if not original:
            raise InputError(f"{path} contains no faces (only curves or points): export the body as a solid")
        solid, kept = _sewn(path, original, attributes)
        healing.append(f"{len(original)} separate faces were sewn into a solid")
    if not solid.isValid():
        raise InputError(f"{path} contains an invalid solid (its faces cross or do not meet): repair it in CAD")
    faces = tuple(
        KnownFace(shape=face, name=kept.get(face, ("", ""))[0], colour=kept.get(face, ("", ""))[1])
        for face in solid.Faces()
    )
    return StepBody(solid=solid, faces=faces, healing=tuple(healing))


def _overlap(solids: Sequence[Shape]) -> str:
    """Clause about two solids that overlap; empty if there are none."""
    boxes = [solid.BoundingBox() for solid in solids]
    low = np.array([(box.xmin, box.ymin, box.zmin) for box in boxes])
    high = np.array([(box.xmax, box.ymax, box.zmax) for box in boxes])
    for one, other in combinations(range(len(solids)), 2):
        if (low[one] >= high[other]).any() or (low[other] >= high[one]).any():
            continue  # intersecting takes a thousand times as long, and assemblies have hundreds of parts
        shared = sum(float(solid.Volume()) for solid in solids[one].intersect(solids[other]).Solids())
        if shared > 0:
            return f", of which number {one + 1} and {other + 1} overlap by {shared:.3g} mm^3"
    return ""


def _sewn(
    path: Path, faces: Sequence[Shape], attributes: Mapping[Shape, tuple[str, str]]
) -> tuple[Shape, dict[Shape, tuple[str, str]]]:
    """Solid sewn from separate faces, with the name and colour of each face."""
    import cadquery as cq
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
    from OCP.BRepLib import BRepLib
    from OCP.TopoDS import TopoDS

    sewing = BRepBuilderAPI_Sewing(SEWN)
    for face in faces:
        sewing.Add(face.wrapped)
    sewing.Perform()
    if sewing.NbFreeEdges():
        x, y, z = cq.Shape.cast(sewing.FreeEdge(1)).Center().toTuple()
        raise InputError(
            f"{path} holds an open surface, {sewing.NbFreeEdges()} edges of which belong to only one face (one is at "
            f"({x:.4g}, {y:.4g}, {z:.4g}) mm): close it in CAD and export a solid"
        )
    shells = cq.Shape.cast(sewing.SewedShape()).Shells()
    if len(shells) != 1:
        raise InputError(f"{path} holds {len(shells)} closed surfaces: export only the intended body, as a solid")
    made = BRepBuilderAPI_MakeSolid(TopoDS.Shell_s(shells[0].wrapped)).Solid()
    BRepLib.OrientClosedSolid_s(made)
    solid = cq.Shape.cast(made)
    changed = {cq.Shape.cast(sewing.Modified(face.wrapped)): attributes[face] for face in faces if face in attributes}
    return solid, {face: changed[face] for face in solid.Faces() if face in changed}


# Objects of the kernel's reader; the actual types would import it with this module.
Reader: TypeAlias = Any
Entity: TypeAlias = Any


def face_names(reader: Reader, faces: list[Any]) -> list[str]:
    """Name of the ADVANCED_FACE of each face; empty if there is none."""
    return [_text(entity.Name()) if entity is not None else "" for entity in _entities(reader, faces)]


def face_colours(reader: Reader, faces: list[Any]) -> list[str]:
    """Colour of each face as "#RRGGBB"; empty for a face without its own colour in the file."""
    from OCP.Quantity import Quantity_Color
    from OCP.STEPConstruct import STEPConstruct, STEPConstruct_Styles

    styles = STEPConstruct_Styles(reader.WS())
    if not styles.LoadStyles():
        return [""] * len(faces)
    process, coloured = reader.WS().TransferReader().TransientProcess(), []
    for k in range(1, styles.NbStyles() + 1):
        item = styles.Style(k)
        shape = STEPConstruct.FindShape_s(process, item.Item())
        for colour in _surface_colours(item):
            decoded = Quantity_Color()
            if not shape.IsNull() and STEPConstruct_Styles.DecodeColor_s(colour, decoded):
                coloured.append((shape, str(Quantity_Color.ColorToHex_s(decoded).ToCString())))

    def of(face: Any) -> str:
        # Partners have the same surface and edges, in any placement of the assembly in the file.
        return next((colour for shape, colour in coloured if face.wrapped.IsPartner(shape)), "")

    return [of(face) for face in faces]


def _entities(reader: Reader, faces: list[Any]) -> list[Entity | None]:
    from OCP.StepShape import StepShape_AdvancedFace

    transfer = reader.WS().TransferReader()
    # -1 requests the entity itself, independently of entities between it and the shape.
    result = [transfer.EntityFromShapeResult(face.wrapped, -1) for face in faces]
    return [entity if isinstance(entity, StepShape_AdvancedFace) else None for entity in result]


def _text(name: Any) -> str:
    return "" if name is None else str(name.ToCString())


def _surface_colours(item: Entity) -> Iterator[Entity]:
    """Colours at STYLED_ITEM > SURFACE_STYLE_USAGE > SURFACE_SIDE_STYLE > FILL_AREA_STYLE (ISO 10303-46)."""
    for assignment in _members(item.Styles()):
        for style in _members(assignment.Styles()):
            usage = style.SurfaceStyleUsage()
            for element in _members(usage.Style().Styles()) if usage is not None else ():
                area = element.SurfaceStyleFillArea()
                for fill in _members(area.FillArea().FillStyles()) if area is not None else ():
                    coloured = fill.FillAreaStyleColour()
                    if coloured is not None:
                        yield coloured.FillColour()


def _members(array: Any) -> Iterator[Any]:
    if array is not None:
        for k in range(array.Lower(), array.Upper() + 1):
            yield array.Value(k)
