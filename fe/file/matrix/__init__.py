"""Formats of sparse matrices, one file each; `MATRIX_FORMATS` finds them."""

from collections.abc import Mapping

from fe.file.matrix_content import FileMatrix
from fe.file.registry import FileFormat, format_registry
from geometry.registry import Registry

MATRIX_FORMATS: Registry[FileFormat[Mapping[str, FileMatrix]]] = format_registry("matrix")
