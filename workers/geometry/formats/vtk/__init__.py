"""VTK's files of surfaces and cells: the legacy format, and the XML formats VTP, VTU and VTS."""

from workers.geometry.formats.vtk.legacy import is_legacy_vtk, read_legacy_vtk
from workers.geometry.formats.vtk.xml import is_vtk_xml, read_vtk_xml

__all__ = ["is_legacy_vtk", "is_vtk_xml", "read_legacy_vtk", "read_vtk_xml"]
