"""Elements, one file each; `ELEMENTS` finds them by meshio's name of the cell."""

from fe.element.hex8 import HEX8
from fe.element.hex20 import HEX20
from fe.element.registry import ELEMENTS, REGISTRY
from fe.element.table import Element
from fe.element.tet10 import TET10

__all__ = ["ELEMENTS", "HEX8", "HEX20", "REGISTRY", "TET10", "Element"]
