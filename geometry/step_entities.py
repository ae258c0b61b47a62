"""What a STEP file says of its faces beside their shape: the name and the colour of each."""

from collections.abc import Iterator
from typing import Any, TypeAlias

# Objects of the kernel's reader; their true types would import it with this module.
Reader: TypeAlias = Any
Entity: TypeAlias = Any


def face_names(reader: Reader, faces: list[Any]) -> list[str]:
    """Name of the ADVANCED_FACE that each face came from; empty where there is none."""
    return [_text(entity.Name()) if entity is not None else "" for entity in _entities(reader, faces)]


def face_colours(reader: Reader, faces: list[Any]) -> list[str]:
    """Colour of each face as "#RRGGBB"; empty where the file gives it none of its own."""
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
        # Partners: the same surface and edges, wherever the assembly in the file has put them.
        return next((colour for shape, colour in coloured if face.wrapped.IsPartner(shape)), "")

    return [of(face) for face in faces]


def _entities(reader: Reader, faces: list[Any]) -> list[Entity | None]:
    from OCP.StepShape import StepShape_AdvancedFace

    transfer = reader.WS().TransferReader()
    # -1 asks for the entity itself, whatever stands between it and the shape.
    found = [transfer.EntityFromShapeResult(face.wrapped, -1) for face in faces]
    return [entity if isinstance(entity, StepShape_AdvancedFace) else None for entity in found]


def _text(name: Any) -> str:
    return "" if name is None else str(name.ToCString())


def _surface_colours(item: Entity) -> Iterator[Entity]:
    """STYLED_ITEM > styles > SURFACE_STYLE_USAGE > SURFACE_SIDE_STYLE > FILL_AREA_STYLE > colour (ISO 10303-46)."""
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
