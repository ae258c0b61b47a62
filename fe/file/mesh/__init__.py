"""Mesh formats, one file each; `MESH_FORMATS` finds them."""

from fe.file.mesh_content import FileMesh
from fe.file.registry import FileFormat, format_registry
from geometry.registry import Registry

MESH_FORMATS: Registry[FileFormat[FileMesh]] = format_registry("mesh")
