"""What content that is no readable mesh begins with, and what to do instead of sending it."""

import re
from dataclasses import dataclass

CAD = "export it as STL, OBJ or GLB from your CAD program or from FreeCAD"
BLENDER = "export it as STL, OBJ or GLB from Blender"
PICTURE = "send the mesh itself"
POINTS = "make a surface of them (in MeshLab or CloudCompare) and send it as PLY or OBJ"
VOLUME = "extract a surface (in 3D Slicer or ParaView) and send it as STL or PLY"
UNPACK = "unpack it and send the meshes, or a zip of them"


@dataclass(frozen=True)
class Refused:
    """A kind of content that is not read.

    Attributes
    ----------
    what : str
        As it stands in a sentence: "an FBX scene".
    instead : str
        What the user can do.
    """

    what: str
    instead: str

    @property
    def sentence(self) -> str:
        """Say what the file is and what to do instead."""
        return f"the file is {self.what}, which is not read: {self.instead}"


def _from(program: str) -> str:
    """Say from where to export."""
    return f"export it as STL, OBJ or GLB from {program}"


def _picture(format: str) -> Refused:
    """Make the refusal of a picture."""
    return Refused(f"a picture ({format})", PICTURE)


STEP = Refused("a STEP model (CAD surfaces, no mesh)", CAD)
IGES = Refused("an IGES model (CAD surfaces, no mesh)", CAD)
SAT = Refused("an ACIS model (CAD surfaces, no mesh)", CAD)
PARASOLID = Refused("a Parasolid model (CAD surfaces, no mesh)", CAD)
SOLIDWORKS = Refused("a SolidWorks document", _from("SolidWorks"))
FBX = Refused("an FBX scene", BLENDER)
THREEDS = Refused("a 3DS scene", _from("3ds Max or MeshLab"))
MAYA = Refused("a Maya scene", _from("Maya"))
MAX = Refused("a 3ds Max scene", _from("3ds Max"))
INVENTOR = Refused("an Inventor document", _from("Autodesk Inventor"))
COMPOUND = Refused("a document of a Windows program (OLE)", _from("the program that wrote it"))
USD = Refused("a USD scene", _from("Blender or usdview"))
VRML = Refused("a VRML scene", _from("MeshLab or Blender"))
X3D = Refused("an X3D scene", _from("MeshLab or Blender"))
MESHLAB = Refused("a MeshLab project, which only names meshes", "send the meshes themselves")
FREECAD = Refused("a FreeCAD document", _from("FreeCAD"))
OPENSCAD = Refused("an OpenSCAD program", "render it and export it as STL or OFF from OpenSCAD")
XYZ = Refused("a list of points without a surface (XYZ, PTS)", POINTS)
GCODE = Refused("G-code (the path of a printer or mill, no mesh)", "send the mesh it was made from")
ALEMBIC = Refused("an Alembic cache", BLENDER)
HDF5 = Refused("an HDF5 file", "write the mesh out of it as PLY, OBJ or STL")
MGH = Refused("an MGH image of FreeSurfer (a volume or values, no surface)", VOLUME)
ANNOTATION = Refused(
    "a FreeSurfer annotation", "send the surface it belongs to, such as lh.pial or lh.white"
)
MESHB = Refused("a binary Medit mesh (.meshb)", "write it as text (.mesh), as Mmg and Gmsh can")
MATERIALS = Refused("a material library of an OBJ file", "send the .obj file")
MATLAB = Refused("a MATLAB file of arrays", "write its vertices and faces as OFF or PLY")
NUMPY = Refused("a file of numpy arrays", "write its vertices and faces as OFF or PLY")
OFFICE = Refused("an office document", PICTURE)
IMAGE = Refused("a picture", PICTURE)
FILM = Refused("a film or sound", PICTURE)
PROGRAM = Refused("a program for computers", PICTURE)
SHORTCUT = Refused("a shortcut to another file", "send the file that it points to")
SKETCHUP = b"\xff\xfe\xff\x0eS\0k\0e\0t\0c\0h\0U\0p\0"  # begins like text in UTF-16

STARTS: tuple[tuple[bytes, Refused], ...] = (
    (b"ACIS BinaryFile", SAT),
    (b"ASM BinaryFile", SAT),
    (b"PS\0\0", PARASOLID),
    (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ", PARASOLID),
    (b"**PART1;", PARASOLID),
    (b"Kaydara FBX Binary", FBX),
    (b"; FBX ", FBX),
    (b"BLENDER", Refused("a Blender file", BLENDER)),
    (b"//Maya ASCII", MAYA),
    (b"QC4DC4D", Refused("a Cinema 4D scene", _from("Cinema 4D"))),
    (SKETCHUP, Refused("a SketchUp model", _from("SketchUp"))),
    (b"3D Geometry File Format", Refused("a Rhino model", _from("Rhino"))),
    (b"V5_CFV2", Refused("a CATIA document", _from("CATIA"))),
    (b"#UGC:2", Refused("a Creo or Pro/ENGINEER part", _from("Creo"))),
    (b"AutoCAD Binary DXF", Refused("a DXF drawing", _from("your CAD program or FreeCAD"))),
    (b"PXR-USDC", USD),
    (b"#usda ", USD),
    (b"Ogawa", ALEMBIC),
    (b"#VRML ", VRML),
    (b"#Inventor V", Refused("an Open Inventor scene", _from("MeshLab or Blender"))),
    (b"#X3D ", X3D),
    (b"*3DSMAX_ASCIIEXPORT", Refused("an ASE scene", _from("3ds Max or Blender"))),
    (b"xof 0", Refused("a DirectX .x model", _from("Blender or MeshLab"))),
    (b"OCTM", Refused("an OpenCTM mesh", _from("MeshLab"))),
    (b"U3D\0", Refused("a U3D scene", _from("MeshLab"))),
    (b"PMX ", Refused("an MMD model", BLENDER)),
    (b"HIERARCHY", Refused("a recording of motion (BVH)", "send the mesh that it moves")),
    (b"\xc1\x83\x2a\x9e", Refused("an Unreal asset", _from("the Unreal editor"))),
    (b"UnityFS", Refused("a Unity asset bundle", _from("the Unity editor"))),
    (b"%YAML 1.1\n%TAG !u! tag:unity3d", Refused("a Unity asset", _from("the Unity editor"))),
    (b"LASF", Refused("a LAS point cloud (points, no surface)", POINTS)),
    (b"# .PCD v", Refused("a PCD point cloud (points, no surface)", POINTS)),
    (b"ASTM-E57", Refused("an E57 point cloud (points, no surface)", POINTS)),
    (b"NRRD000", Refused("an NRRD image (a volume, no surface)", VOLUME)),
    (b"ObjectType = Image", Refused("a MetaImage (a volume, no surface)", VOLUME)),
    (b"GCDE", GCODE),
    (b"newmtl ", MATERIALS),
    (b"MATLAB 5.0 MAT-file", MATLAB),
    (b"\x93NUMPY", NUMPY),
    (b"\x89HDF\r\n\x1a\n", HDF5),
    (b"%PDF-", Refused("a PDF document", PICTURE)),
    (b"{\\rtf", OFFICE),
    (b"\x89PNG\r\n\x1a\n", _picture("PNG")),
    (b"\xff\xd8\xff", _picture("JPEG")),
    *((start, _picture("GIF")) for start in (b"GIF87a", b"GIF89a")),
    *((start, _picture("TIFF")) for start in (b"II*\0", b"MM\0*")),
    *((start, IMAGE) for start in (b"8BPS\0\1", b"DDS \x7c\0\0\0", b"qoif", b"gimp xcf")),
    *((start, IMAGE) for start in (b"#?RADIANCE", b"v/1\x01", b"\0\0\1\0\1\0", b"icns\0")),
    *((start, IMAGE) for start in (b"\xabKTX 11\xbb\r\n", b"\xabKTX 20\xbb\r\n")),
    *((start, FILM) for start in (b"\x1aE\xdf\xa3", b"OggS\0", b"ID3\2", b"ID3\3", b"ID3\4")),
    (b"\x7fELF", PROGRAM),
    (b"L\0\0\0\x01\x14\x02\0", SHORTCUT),
    (b"[InternetShortcut]", SHORTCUT),
    (b"bplist00", Refused("a macOS property list", PICTURE)),
    (b"SQLite format 3\0", Refused("a database", PICTURE)),
    (b"\0\x05\x16\x07", Refused("a macOS resource fork", "send the file of the same name")),
    (b"\0\x05\x16\0", Refused("a macOS resource fork", "send the file of the same name")),
    (b"\0\0\0\x01Bud1", Refused("a folder's settings of macOS", PICTURE)),
    (b"7z\xbc\xaf'\x1c", Refused("a 7z archive", UNPACK)),
    (b"Rar!\x1a\x07", Refused("a RAR archive", UNPACK)),
    (b"MSCF\0\0\0\0", Refused("a cabinet archive", UNPACK)),
    (b"(\xb5/\xfd", Refused("packed by zstd", UNPACK)),
    (b'\x04"M\x18', Refused("packed by lz4", UNPACK)),
    (b"LZIP", Refused("packed by lzip", UNPACK)),
    (b"\x1f\x9d", Refused("packed by compress (.Z)", UNPACK)),
)
"""First bytes that say all; blanks before them are not passed over."""


def _compiled(pattern: bytes, refused: Refused) -> tuple[re.Pattern[bytes], Refused]:
    """Make a pattern that is matched at the first bytes; a point matches any byte."""
    return re.compile(pattern, re.DOTALL | re.IGNORECASE), refused


PATTERNS: tuple[tuple[re.Pattern[bytes], Refused], ...] = (
    _compiled(
        rb"\s*ISO-10303-21\s*;.{0,4000}FILE_SCHEMA[^;]{0,40}IFC",
        Refused("an IFC building", _from("Blender or FreeCAD")),
    ),
    _compiled(rb"\s*(?:/\*.{0,2000}?\*/\s*)?ISO-10303-21\s*;", STEP),
    _compiled(rb"[^\r\n]{72}S[ 0]{0,6}1[ \t]*[\r\n]", IGES),
    _compiled(rb"\d{3,5} +-?\d+ +\d+ +\d+ *\r?\n@?\d+ [^\r\n]*(?:ACIS|ASM|ShapeManager)", SAT),
    _compiled(rb"(?:;[^\r\n]*[\r\n]+)*\s*FBXHeaderExtension\s*:", FBX),
    _compiled(rb"FOR[48].{4,20}?Maya", MAYA),
    _compiled(rb"FORM.{4}LW[OL][B23]", Refused("a LightWave model", _from("LightWave or Blender"))),
    _compiled(rb"MM.{4}(?:\x02\0\x0a\0\0\0|\x3d\x3d)", THREEDS),
    _compiled(rb"Version \d+\.\d+ +JT", Refused("a JT model", _from("your CAD program"))),
    _compiled(rb"AC10\d\d[\0-\x09]", Refused("a DWG drawing", _from("your CAD program"))),
    _compiled(
        rb"(?:\s*999[ \t]*\r?\n[^\n]*\n)*\s*0[ \t]*\r?\n[ \t]*SECTION\s",
        Refused("a DXF drawing", _from("your CAD program or FreeCAD")),
    ),
    _compiled(
        rb"(?:#[^\n]*\n\s*)*VERSION +\.?\d[.\d]*\s+FIELDS ",
        Refused("a PCD point cloud (points, no surface)", POINTS),
    ),
    _compiled(rb".{128}DICM", Refused("a DICOM image (a slice or a volume, no surface)", VOLUME)),
    _compiled(
        rb"(?:\x5c\x01\0\0|\0\0\x01\x5c).{340}(?:n\+1|ni1)\0",
        Refused("a NIfTI image (a volume, no surface)", VOLUME),
    ),
    _compiled(
        rb"(?:\x1c\x02\0\0|\0\0\x02\x1c)n[+i]2\0",
        Refused("a NIfTI image (a volume, no surface)", VOLUME),
    ),
    _compiled(
        rb".{208}MAP [\x11\x44]", Refused("an MRC or CCP4 map (a volume, no surface)", VOLUME)
    ),
    _compiled(rb"\0\0\0\x01(?:\0\0.{2}){4}\0\0\0[\0\x01\x03\x04]", MGH),
    _compiled(
        rb"\x01\0\0\0[\x01-\x04]\0\0\0\x03\0\0\0|\0\0\0\x01\0\0\0[\x01-\x04]\0\0\0\x03", MESHB
    ),
    _compiled(rb"RIFF.{4}WEBP", _picture("WebP")),
    _compiled(rb"RIFF.{4}(?:AVI |WAVE)", FILM),
    _compiled(rb".{4}ftyp(?:hei|avif|mif1)", IMAGE),
    _compiled(rb".{4}ftyp", FILM),
    _compiled(rb"BM.{4}\0\0\0\0.{4}[\x0c\x28\x38\x40\x6c\x7c]\0\0\0", _picture("BMP")),
    _compiled(rb"MZ.{58}.{2}\0\0", PROGRAM),
    _compiled(rb"\s*(?:#[^\n]*\n\s*)*newmtl[ \t]", MATERIALS),
    _compiled(rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", COMPOUND),
)
"""What the content matches at its first bytes, in this order."""

ROOTS: dict[str, Refused] = {
    "svg": _picture("SVG"),
    "x3d": X3D,
    "meshlabproject": MESHLAB,
    "plist": Refused("a macOS property list", PICTURE),
    "kml": Refused("a KML map", _from("the program that wrote it")),
    "citymodel": Refused("a CityGML model", _from("the program that wrote it")),
}
"""Root elements of XML, in lower case, without their prefix."""

OF_COMPOUND: dict[str, Refused] = {
    **{"max": MAX, "chr": MAX},
    **{"sldprt": SOLIDWORKS, "sldasm": SOLIDWORKS, "slddrw": SOLIDWORKS},
    **{"ipt": INVENTOR, "iam": INVENTOR},
    **{"doc": OFFICE, "xls": OFFICE, "ppt": OFFICE},
    "db": IMAGE,
}
"""What an OLE document is, by its ending."""

OF_UNKNOWN_BYTES: dict[str, Refused] = {
    **OF_COMPOUND,
    **{"3ds": THREEDS, "mb": MAYA, "fbx": FBX, "abc": ALEMBIC},
    **{"x_t": PARASOLID, "x_b": PARASOLID, "xmt_txt": PARASOLID, "sab": SAT},
    **{"tga": IMAGE, "mp3": FILM, "exe": PROGRAM, "dll": PROGRAM},
    **{"mgh": MGH, "annot": ANNOTATION},
    "c4d": Refused("a Cinema 4D scene", _from("Cinema 4D")),
    "blend": Refused("a Blender file", BLENDER),
    "skp": Refused("a SketchUp model", _from("SketchUp")),
    "3dm": Refused("a Rhino model", _from("Rhino")),
    "jt": Refused("a JT model", _from("your CAD program")),
    "dwg": Refused("a DWG drawing", _from("your CAD program")),
    "prt": Refused("a part of a CAD program", CAD),
    "catpart": Refused("a CATIA document", _from("CATIA")),
    "catproduct": Refused("a CATIA document", _from("CATIA")),
    "ztl": Refused("a ZBrush tool", _from("ZBrush")),
    "zpr": Refused("a ZBrush project", _from("ZBrush")),
    "lwo": Refused("a LightWave model", _from("LightWave or Blender")),
    "uasset": Refused("an Unreal asset", _from("the Unreal editor")),
    "unity": Refused("a Unity scene", _from("the Unity editor")),
    "vox": Refused("a voxel model", "export it as OBJ or PLY from MagicaVoxel"),
    "raw": Refused("raw voxels (a volume, no surface)", VOLUME),
    "rwx": Refused("a RenderWare model", BLENDER),
}
"""What bytes are that nothing else tells: by the ending, in lower case."""

OF_UNKNOWN_TEXT: dict[str, Refused] = {
    **{"scad": OPENSCAD, "gcode": GCODE, "gco": GCODE, "nc": GCODE, "ngc": GCODE},
    **{"sat": SAT, "x_t": PARASOLID, "xmt_txt": PARASOLID, "stp": STEP, "step": STEP},
    **{"igs": IGES, "iges": IGES, "ma": MAYA, "fbx": FBX, "wrl": VRML, "mtl": MATERIALS},
    **{"xyz": XYZ, "pts": XYZ, "asc": XYZ, "xyzrgb": XYZ, "xyzn": XYZ, "ptx": XYZ},
    "pcd": Refused("a PCD point cloud (points, no surface)", POINTS),
    "dxf": Refused("a DXF drawing", _from("your CAD program or FreeCAD")),
    **{"py": PROGRAM, "js": PROGRAM, "sh": PROGRAM, "bat": PROGRAM},
}
"""What text is that nothing else tells: by the ending, in lower case."""
