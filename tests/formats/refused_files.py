"""Files that are no mesh, or no mesh that Proteus reads: each is refused by name."""

import io
import struct
import zipfile
from functools import partial

from tests.formats.kinds import BODY, REGISTER, Kind

NOT_READ = "Not read"
IN_PLACE = "Something else in place of the mesh"
CAD = "CAD surfaces, no mesh: export STL, OBJ or GLB from the CAD program or from FreeCAD."
POINTS = "Points without a surface: make one in MeshLab or CloudCompare and send PLY or OBJ."
VOLUME = "A volume without a surface: extract one in 3D Slicer or ParaView and send STL or PLY."


def zipped(*names: str, align: int = 0) -> bytes:
    """Zip archive of entries of these names."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name in names:
            entry = zipfile.ZipInfo(name)
            if align:
                entry.extra = struct.pack("<HH", 0x1986, filler := align - 34 - len(name))
                entry.extra += bytes(filler)
            archive.writestr(entry, b"content " * 9)
    return file.getvalue()


def export_from(program: str) -> str:
    """Return the row's sentence about a scene of a program."""
    return f"Export STL, OBJ or GLB from {program}."


COMPOUND = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504)
OBJ_POINTS = "".join(f"{x} {y} {z}\n" for x, y, z in BODY.vertices).encode()

FILES: tuple[tuple[str, str, str, str, bytes], ...] = (
    ("STEP", CAD, "a.stp", "STEP model", b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AP214'));\n"),
    ("STEP named .stl", CAD, "a.stl", "STEP model", b"ISO-10303-21;\r\nHEADER;\r\n" * 9),
    (
        *("IFC", export_from("Blender or FreeCAD"), "a.ifc", "an IFC building"),
        b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\n",
    ),
    ("IGES", CAD, "a.igs", "an IGES model", b"from a program".ljust(72) + b"S      1\n"),
    ("Parasolid", CAD, "a.x_t", "Parasolid", b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ[\n**PART1;\n"),
    ("ACIS", CAD, "a.sat", "an ACIS", b"700 0 1 0 \n16 Autodesk AutoCAD 19 ASM 221.0.0 NT\n"),
    ("SolidWorks", export_from("SolidWorks"), "a.SLDPRT", "a SolidWorks document", COMPOUND),
    ("Inventor", export_from("Autodesk Inventor"), "a.ipt", "an Inventor document", COMPOUND),
    ("3ds Max", export_from("3ds Max"), "a.max", "a 3ds Max scene", COMPOUND),
    ("CATIA", export_from("CATIA"), "a.CATPart", "a CATIA document", b"V5_CFV2\0" + bytes(99)),
    ("JT", export_from("your CAD program"), "a.jt", "a JT model", b"Version 9.5 JT  DM\0\0"),
    ("DWG", export_from("your CAD program"), "a.dwg", "a DWG drawing", b"AC1032\0\0\0\0\0\0"),
    (
        *("DXF", export_from("your CAD program or FreeCAD"), "a.dxf", "a DXF drawing"),
        b"999\r\nmade by a program\r\n  0\r\nSECTION\r\n  2\r\nHEADER\r\n",
    ),
    ("FBX, binary", export_from("Blender"), "a.fbx", "an FBX", b"Kaydara FBX Binary  \0\x1a\0"),
    ("FBX, text", export_from("Blender"), "a.fbx", "an FBX", b"; FBX 7.3.0 project file\n"),
    ("Blender", export_from("Blender"), "a.blend", "a Blender file", b"BLENDER-v300REND\0\0"),
    (
        *("3DS", export_from("3ds Max or MeshLab"), "a.3ds", "a 3DS scene"),
        b"MM\x40\0\0\0\x02\0\x0a\0\0\0\3\0\0\0" + bytes(50),
    ),
    ("Maya, text", export_from("Maya"), "a.ma", "a Maya scene", b"//Maya ASCII 2020 scene\n"),
    ("Maya, binary", export_from("Maya"), "a.mb", "a Maya scene", b"FOR4\0\0\1\0MayaHEAD\0"),
    ("Cinema 4D", export_from("Cinema 4D"), "a.c4d", "a Cinema 4D", b"QC4DC4D6\0\0\0\1"),
    (
        *("SketchUp", export_from("SketchUp"), "a.skp", "a SketchUp model"),
        b"\xff\xfe\xff\x0e" + "SketchUp Model".encode("utf-16-le") + bytes(range(128, 256)),
    ),
    ("Rhino", export_from("Rhino"), "a.3dm", "a Rhino", b"3D Geometry File Format        7\0"),
    ("USD", export_from("Blender or usdview"), "a.usdc", "a USD scene", b"PXR-USDC\0\x08\0\0"),
    ("USD, text", export_from("Blender or usdview"), "a.usda", "a USD", b"#usda 1.0\n(\n)\n"),
    (
        *("USDZ", export_from("Blender or usdview"), "a.usdz", "a USD scene"),
        zipped("scene.usdc", "0/texture.png", align=64),
    ),
    ("Alembic", export_from("Blender"), "a.abc", "an Alembic cache", b"Ogawa\xff\0\1\0\0"),
    ("FreeCAD", export_from("FreeCAD"), "a.FCStd", "FreeCAD", zipped("Document.xml", "a.brp")),
    (
        *("OpenSCAD", "Render it and export STL or OFF from OpenSCAD.", "a.scad"),
        *("an OpenSCAD program", b"difference() { cube(10); sphere(6); }\n"),
    ),
    ("Unreal", export_from("the Unreal editor"), "a.uasset", "Unreal", b"\xc1\x83\x2a\x9e\0\0"),
    ("Unity", export_from("the Unity editor"), "a.unity3d", "Unity", b"UnityFS\0\0\0\0\6"),
    (
        *("MeshLab project", "It only names meshes: send those.", "a.mlp", "a MeshLab project"),
        b"<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n</MeshLabProject>\n",
    ),
    (
        *("PCD", POINTS, "a.pcd", "a PCD point cloud"),
        b"# .PCD v.7 - Point Cloud Data\nVERSION .7\nFIELDS x y z\n",
    ),
    ("LAS", POINTS, "a.las", "a LAS point cloud", b"LASF\0\0\0\0" + bytes(219)),
    ("E57", POINTS, "a.e57", "an E57 point cloud", b"ASTM-E57\1\0\0\0" + bytes(40)),
    ("XYZ", POINTS, "a.xyz", "a list of points without a surface", OBJ_POINTS),
    ("PTS", POINTS, "a.pts", "a list of points", b"642\n" + OBJ_POINTS),
    ("NRRD", VOLUME, "a.nrrd", "a volume, no surface", b"NRRD0004\ntype: short\n"),
    ("DICOM", VOLUME, "a.dcm", "a slice or a volume", bytes(128) + b"DICM\2\0\0\0UL\4\0"),
    ("NIfTI", VOLUME, "a.nii", "NIfTI", b"\x5c\1\0\0" + bytes(340) + b"n+1\0" + bytes(40)),
    (
        *("G-code", "The path of a printer: send the mesh it was made from.", "a.gcode", "G-code"),
        b"; generated by PrusaSlicer\n\nM73 P0 R12\nM104 S215 ; heat\nG28 ; home\nG1 X1 Y2\n",
    ),
    (
        *("PNG picture", "Send the mesh itself.", "a.png", "a picture (PNG)"),
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    ),
    ("JPEG picture", "Send the mesh itself.", "a.jpg", "a picture (JPEG)", b"\xff\xd8\xff\xe0\0"),
    ("PDF", "Send the mesh itself.", "a.pdf", "a PDF document", b"%PDF-1.7\n%\xe2\xe3\n"),
    ("office document", "Send the mesh itself.", "a.docx", "office", zipped("word/document.xml")),
    ("material library", "Send the .obj file.", "a.mtl", "material library", b"# x\nnewmtl a\n"),
    ("MATLAB arrays", "Write OFF or PLY.", "a.mat", "MATLAB", b"MATLAB 5.0 MAT-file, Pla"),
    ("numpy arrays", "Write OFF or PLY.", "a.npy", "numpy arrays", b"\x93NUMPY\1\0v\0{'descr'"),
    ("HDF5", "Write the mesh out of it.", "a.h5", "an HDF5 file", b"\x89HDF\r\n\x1a\n\0\0\0"),
    ("7z archive", "Unpack it and send a zip.", "a.7z", "a 7z archive", b"7z\xbc\xaf'\x1c\0\4"),
    ("RAR archive", "Unpack it and send a zip.", "a.rar", "a RAR archive", b"Rar!\x1a\7\1\0"),
    ("zstd", "Unpack it and send a zip.", "a.ply.zst", "packed by zstd", b"(\xb5/\xfd\4X\0\0"),
)

LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"a" * 64 + b"\nsize 12345\n"
PAGE = b"<!DOCTYPE html>\n<html><head><title>Sign in</title></head><body>v 1 2 3</body></html>"
DOWNLOAD = "A web page: the download went wrong, download the file itself."
AGAIN = "The download went wrong: download it again."

PLACEHOLDERS: tuple[tuple[str, str, str, str, bytes], ...] = (
    ("Git LFS pointer", "Run `git lfs pull`.", "a.stl", "Git LFS pointer of 12,345 bytes", LFS),
    (
        "Git LFS pointer, CRLF",
        "Run `git lfs pull`.",
        "a.obj",
        "12,345",
        LFS.replace(b"\n", b"\r\n"),
    ),
    (
        *("git-annex pointer", "Run `git annex get`.", "a.ply", "a git-annex pointer"),
        b"/annex/objects/SHA256E-s1048576--abc.ply\n",
    ),
    ("web page", DOWNLOAD, "a.stl", "a web page", PAGE),
    ("web page in UTF-16", DOWNLOAD, "a.stl", "a web page", PAGE.decode().encode("utf-16")),
    (
        *("web page in XHTML", DOWNLOAD, "a.obj", "a web page"),
        b'\xef\xbb\xbf<?xml version="1.0"?>\n<!-- v 1 2 3 -->\n<HTML lang="en">',
    ),
    (
        *("error message in JSON", AGAIN, "a.glb", "a server's message in JSON"),
        b'{"error": {"code": 404, "message": "not found"}}',
    ),
    (
        *("error message in XML", AGAIN, "a.glb", "a server's error message in XML"),
        b'<?xml version="1.0"?>\n<Error><Code>NoSuchKey</Code></Error>',
    ),
    ("error message in text", AGAIN, "a.ply", "404: Not Found", b"404: Not Found"),
    ("other JSON", "Export the mesh as GLB, OBJ or STL.", "a.json", "JSON", b'{"metadata": {}}'),
    ("empty file", "Send it again.", "a.stl", "the file is empty", b""),
    ("blanks only", "Send it again.", "a.obj", "the file is empty", b" \r\n\r\n"),
    ("zeros only", "Send it again.", "a.stl", "all of them zero", bytes(50_084)),
    ("Windows shortcut", "Send the file it points to.", "a.lnk", "shortcut", b"L\0\0\0\1\x14\2\0"),
    (
        *("macOS resource fork", "Send the file of the same name.", "._a.stl", "resource fork"),
        b"\0\x05\x16\x07\0\2\0\0Mac OS X        " + bytes(200),
    ),
)


for section, files in ((NOT_READ, FILES), (IN_PLACE, PLACEHOLDERS)):
    REGISTER.kinds += [
        Kind(section, variant, treatment, partial(bytes, data), name, facts=None, reason=reason)
        for variant, treatment, name, reason, data in files
    ]
