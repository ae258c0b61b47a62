"""The elements, each one table; `ELEMENTS` finds them by meshio's name of the cell."""

from fe.element.hex8 import HEX8
from fe.element.hex20 import HEX20
from fe.element.table import Element
from fe.element.tet10 import TET10

#: All elements by meshio cell type. A new element is one file and one line here.
ELEMENTS: dict[str, Element] = {element.cell_type: element for element in (HEX8, HEX20, TET10)}

__all__ = ["ELEMENTS", "HEX8", "HEX20", "TET10", "Element"]
