"""Archives: what is a mesh, what is passed over, and what is refused by name."""

import contextlib
import gzip
import io
import random
import stat
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.meshes import bumpy_sphere, gltf_with_buffer, tetrahedron
from workers.errors import (
    InvalidMeshError,
    ProteusError,
    UnsupportedFormatError,
    UploadTooLargeError,
)
from workers.geometry.formats import parse, write
from workers.geometry.formats.containers import (
    ArchiveLimits,
    Contents,
    Found,
    Member,
    Refused,
    Skipped,
    archive_kind,
    open_archive,
    summarise,
    why_skipped,
)
from workers.geometry.formats.containers.contents import TOO_DEEP
from workers.geometry.formats.containers.members import check_whole

PLY = write(tetrahedron(), "ply")
LIMITS = ArchiveLimits(entries=10, unpacked=1_000_000, entry=200_000)


def write_zip(folder: Path, entries: dict[str, bytes | zipfile.ZipInfo]) -> Path:
    path = folder / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            if isinstance(data, zipfile.ZipInfo):
                archive.writestr(data, b"target")
            else:
                archive.writestr(name, data)
    return path


def contents(path: Path, limits: ArchiveLimits = LIMITS) -> Contents:
    file = io.BytesIO(path.read_bytes())
    kind = archive_kind(file, path.name) or "zip"
    return Contents(open_archive(file, kind, limits), limits)


def read(path: Path, limits: ArchiveLimits = LIMITS) -> dict[str, str]:
    found = {}
    opened = contents(path, limits)
    opened.weights()
    for item in opened.items():
        if isinstance(item, Found):
            found[item.path] = item.data.decode(errors="replace")
        elif isinstance(item, Skipped):
            found[item.path] = f"skipped: {item.detail}"
        else:
            found[item.path] = f"refused: {item.error}"
    return found


def test_meshes_come_out_and_what_lies_beside_them_is_passed_over(tmp_path: Path) -> None:
    path = write_zip(
        tmp_path,
        {
            "cats/a.off": b"OFF a",
            "readme.txt": b"",
            "a.mtl": b"",
            "__MACOSX/a.off": b"",
            ".hidden.off": b"",
            "folder/": b"",
            "odd.ending": b"tried",
            "odd.mesh": PLY,
            "picture.jpg": b"\xff\xd8\xff\xe0",
        },
    )
    assert read(path) == {
        "cats/a.off": "OFF a",
        "readme.txt": "skipped: text",
        "a.mtl": "skipped: material file",
        "__MACOSX/a.off": "skipped: system file",
        ".hidden.off": "skipped: system file",
        "odd.ending": "skipped: file",
        "odd.mesh": PLY.decode(errors="replace"),
        "picture.jpg": "skipped: picture",
    }


@pytest.mark.parametrize(
    "name", ["../x.off", "/etc/x.off", "a/../../x.off", "..\\x.off", "C:/x.off"]
)
def test_a_path_that_leads_out_is_refused_and_the_rest_goes_on(tmp_path: Path, name: str) -> None:
    found = read(write_zip(tmp_path, {name: b"OFF", "good.off": b"OFF"}))
    assert found.pop("good.off") == "OFF"
    assert list(found.values()) == ["refused: the entry's path leads out of the archive"]


def test_a_bomb_is_refused_by_its_ratio(tmp_path: Path) -> None:
    found = read(write_zip(tmp_path, {"bomb.off": bytes(190_000), "good.off": b"OFF"}))
    assert "times its packed size, allowed is 200" in found["bomb.off"]
    assert found["good.off"] == "OFF"


def test_a_directory_that_lies_about_sizes_is_caught_while_unpacking(tmp_path: Path) -> None:
    """The directory is patched to declare 10 bytes where thousands come out."""
    path = write_zip(tmp_path, {"liar.off": bytes(range(256)) * 100})
    data = bytearray(path.read_bytes())
    size = (25_600).to_bytes(4, "little")
    for _ in range(data.count(size)):
        at = data.index(size)
        data[at : at + 4] = (10).to_bytes(4, "little")
    path.write_bytes(bytes(data))
    (text,) = read(path).values()
    assert text.startswith("refused: the entry")


def test_links_are_refused_and_archives_within_archives_opened(tmp_path: Path) -> None:
    link = zipfile.ZipInfo("link.off")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("a.off", b"OFF")
    found = read(write_zip(tmp_path, {"link.off": link, "inner.zip": inner.getvalue()}))
    assert "expected a regular file" in found["link.off"]
    assert found["inner.zip/a.off"] == "OFF"


def test_too_many_entries_or_bytes_refuse_the_whole(tmp_path: Path) -> None:
    with pytest.raises(UploadTooLargeError, match="more entries than the 10"):
        read(write_zip(tmp_path, {f"{n}.off": b"" for n in range(11)}))
    with pytest.raises(UploadTooLargeError, match="1200000 bytes"):
        read(write_zip(tmp_path, {f"{n}.off": bytes(200_000) for n in range(6)}))


def test_a_directory_that_is_too_long_is_refused_unread(tmp_path: Path) -> None:
    path = write_zip(tmp_path, {f"{n}{'x' * 900}.off": b"" for n in range(12)})
    with pytest.raises(UploadTooLargeError, match="the archive's directory has"):
        read(path)


@pytest.mark.parametrize("cut", [0, 10, 60, -5])
def test_what_is_no_archive_is_refused(tmp_path: Path, cut: int) -> None:
    path = write_zip(tmp_path, {"a.off": b"OFF" * 50})
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(UnsupportedFormatError, match="cannot be read"):
        read(path)


def test_damaged_entries_are_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    path = write_zip(tmp_path, {"bad.off": bytes(range(256)) * 20, "good.off": b"OFF"})
    data = bytearray(path.read_bytes())
    data[45:60] = b"\xff" * 15
    path.write_bytes(bytes(data))
    found = read(path)
    assert found["bad.off"].startswith("refused: the entry cannot be unpacked")
    assert found["good.off"] == "OFF"
    assert isinstance(next(contents(path).items()), Refused)


OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def tarred(files: dict[str, bytes], *, mode: str = "w", form: int = tarfile.PAX_FORMAT) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode=mode, format=form) as archive:  # type: ignore[call-overload]
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def zipped(files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def read_bytes(folder: Path, data: bytes, limits: ArchiveLimits = LIMITS) -> dict[str, str]:
    path = folder / "archive"
    path.write_bytes(data)
    return read(path, limits)


@pytest.mark.parametrize("mode", ["w", "w:gz", "w:bz2", "w:xz"])
@pytest.mark.parametrize(
    "form", [tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT, tarfile.PAX_FORMAT], ids="ugp".__getitem__
)
def test_tar_archives_are_read_in_every_form(tmp_path: Path, mode: str, form: int) -> None:
    long = "/".join(["folder-of-a-long-name"] * (7 if form == tarfile.USTAR_FORMAT else 20))
    files = {"cats/a.off": OFF, f"{long}/b.off": OFF + b"\n", "readme.txt": b"x" * 1000}
    found = read_bytes(tmp_path, tarred(files, mode=mode, form=form))
    assert found == {
        "cats/a.off": OFF.decode(),
        f"{long}/b.off": OFF.decode() + "\n",
        "readme.txt": "skipped: text",
    }


def test_names_in_a_tar_may_be_of_any_alphabet(tmp_path: Path) -> None:
    for form in (tarfile.GNU_FORMAT, tarfile.PAX_FORMAT):
        assert list(read_bytes(tmp_path, tarred({"Käfer/日本.off": OFF}, form=form))) == [
            "Käfer/日本.off"
        ]


def test_links_devices_and_paths_that_lead_out_of_a_tar_are_refused(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        for name, kind in (("l.off", tarfile.SYMTYPE), ("h.off", tarfile.LNKTYPE)):
            info = tarfile.TarInfo(name)
            info.type, info.linkname = kind, "/etc/passwd"
            archive.addfile(info)
        device = tarfile.TarInfo("d.off")
        device.type = tarfile.CHRTYPE
        archive.addfile(device)
        folder = tarfile.TarInfo("folder")
        folder.type = tarfile.DIRTYPE
        archive.addfile(folder)
        for name in ("../x.off", "/etc/y.off", "folder/good.off"):
            info = tarfile.TarInfo(name)
            info.size = len(OFF)
            archive.addfile(info, io.BytesIO(OFF))
    found = read_bytes(tmp_path, buffer.getvalue())
    assert {name for name, text in found.items() if "regular file" in text} == {
        "l.off", "h.off", "d.off",
    }  # fmt: skip
    assert {name for name, text in found.items() if "leads out" in text} == {
        "../x.off", "/etc/y.off",
    }  # fmt: skip
    assert found["folder/good.off"] == OFF.decode()
    assert len(found) == 6


def test_a_tar_that_is_cut_off_gives_what_is_there(tmp_path: Path) -> None:
    data = tarred({"a.off": OFF, "b.off": OFF * 40})
    found = read_bytes(tmp_path, data[: 512 * 3 + 600])
    assert found["a.off"] == OFF.decode()
    assert "cut off" in found["b.off"]
    damaged = bytearray(data)
    damaged[1024 + 10] ^= 1
    with pytest.raises(UnsupportedFormatError, match="damaged at byte 1,024"):
        read_bytes(tmp_path, bytes(damaged))


@given(st.binary(max_size=3000), st.integers(0, 5000), st.binary(min_size=1, max_size=40))
@settings(deadline=None)
def test_no_damage_is_unexpected(data: bytes, at: int, noise: bytes) -> None:
    for whole in (
        tarred({"a.off": OFF, "b/c.off": data}),
        zipped({"a.off": OFF, "b/c.off": data}),
        zipped({"a.off": OFF, "b/c.off": data}, zipfile.ZIP_LZMA),
    ):
        place = at % len(whole)
        damaged = whole[:place] + noise + whole[place + len(noise) :]
        file = io.BytesIO(damaged)
        with contextlib.suppress(ProteusError):
            kind = archive_kind(file, "a.zip") or "zip"
            opened = Contents(open_archive(file, kind, LIMITS), LIMITS)
            opened.weights()
            assert all(isinstance(i, Found | Refused | Skipped) for i in opened.items())


@pytest.mark.parametrize(
    "method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
)
def test_entries_may_be_packed_in_every_way_that_python_packs(tmp_path: Path, method: int) -> None:
    data = write(bumpy_sphere(2), "off")
    assert read_bytes(tmp_path, zipped({"a.off": data}, method)) == {"a.off": data.decode()}


def test_what_precedes_and_follows_a_zip_does_not_matter(tmp_path: Path) -> None:
    data = zipped({"a.off": OFF})
    file = io.BytesIO(b"#!/bin/sh\n" + data + b"\r\n")
    assert [m.path for m in open_archive(file, "zip", LIMITS).members] == ["a.off"]
    assert read_bytes(tmp_path, data + b"PK\x05\x06 and more")["a.off"] == OFF.decode()


def test_long_records_and_data_descriptors_are_read(tmp_path: Path) -> None:
    """As a program writes that does not know the sizes beforehand."""

    class Pipe(io.BytesIO):
        def seekable(self) -> bool:
            return False

        def seek(self, *_: int) -> int:
            raise OSError

        def tell(self) -> int:
            raise OSError

    pipe = Pipe()
    with zipfile.ZipFile(pipe, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("a.off", "w", force_zip64=True) as entry:
            entry.write(OFF)
        archive.writestr("b.off", OFF)
    assert list(read_bytes(tmp_path, pipe.getvalue())) == ["a.off", "b.off"]


@pytest.mark.parametrize(
    ("stored", "flags", "name"),
    [
        ("käfer.off".encode(), 0x800, "käfer.off"),
        ("käfer.off".encode(), 0, "käfer.off"),
        ("käfer.off".encode("cp437"), 0, "käfer.off"),
        ("käfer.off".encode().decode("cp437").encode(), 0x800, "käfer.off"),
        (b"k\xe4fer.off", 0x800, "kΣfer.off"),  # flagged as UTF-8, which it is not
        (b"cats\\a.off", 0, "cats/a.off"),
        (b"aux. .off", 0, "aux. .off"),
        (b'a:b<c>"d".off', 0, 'a:b<c>"d".off'),
    ],
)
def test_names_are_read_as_they_were_meant(
    tmp_path: Path, stored: bytes, flags: int, name: str
) -> None:
    place = "x" * len(stored)
    data = zipped({place: OFF})
    data = data.replace(place.encode(), stored)
    at = data.index(b"PK\x01\x02")
    data = data[: at + 8] + flags.to_bytes(2, "little") + data[at + 10 :]
    assert list(read_bytes(tmp_path, data)) == [name]


def test_an_encrypted_mesh_is_named_and_an_encrypted_picture_skipped(tmp_path: Path) -> None:
    data = bytearray(zipped({"a.off": OFF, "b.jpg": b"x", "c": b"x"}))
    at = -1
    while (at := data.find(b"PK\x01\x02", at + 1)) >= 0:
        data[at + 8] |= 1
    found = read_bytes(tmp_path, bytes(data))
    assert found["a.off"].startswith("refused: the entry is encrypted")
    assert found["b.jpg"] == "skipped: picture"
    assert found["c"].startswith("skipped: the entry is encrypted")


def test_two_entries_of_one_name_are_two_files(tmp_path: Path) -> None:
    data = zipped({"a.off": OFF, "b.off": OFF + b"\n"}).replace(b"b.off", b"a.off")
    path = tmp_path / "a.zip"
    path.write_bytes(data)
    assert [item.path for item in contents(path).items()] == ["a.off", "a.off"]


@pytest.mark.parametrize("pack", [zipped, tarred])
def test_archives_within_archives_are_opened_one_level_deep(
    tmp_path: Path, pack: Callable[[dict[str, bytes]], bytes]
) -> None:
    deepest = zipped({"no.off": OFF})
    inner = tarred({"in.off": OFF, "deep.zip": deepest, "x.png": b""}, mode="w:gz")
    outer = pack({"a/inner.tar.gz": inner, "b.zip": zipped({"dir/z.off": OFF}), "c.off": OFF})
    assert read_bytes(tmp_path, outer) == {
        "a/inner.tar.gz/in.off": OFF.decode(),
        "a/inner.tar.gz/deep.zip": f"skipped: {TOO_DEEP}",
        "a/inner.tar.gz/x.png": "skipped: picture",
        "b.zip/dir/z.off": OFF.decode(),
        "c.off": OFF.decode(),
    }


def test_limits_hold_over_an_archive_and_those_within(tmp_path: Path) -> None:
    inner = zipped({f"{n}.off": OFF for n in range(4)})
    with pytest.raises(UploadTooLargeError, match="entries, allowed are 10"):
        read_bytes(tmp_path, zipped({f"{n}.zip": inner for n in range(3)}))
    large = zipped({"a.off": random.Random(1).randbytes(180_000)})
    with pytest.raises(UploadTooLargeError, match="unpack to"):
        read_bytes(tmp_path, zipped({f"{n}.zip": large for n in range(3)}))


def test_compressed_tar_bombs_are_refused(tmp_path: Path) -> None:
    limits = ArchiveLimits(entries=10, unpacked=100 << 20, entry=100 << 20, ratio=20)
    for mode in ("w:gz", "w:bz2", "w:xz"):
        bomb = tarred({"a.off": bytes(90 << 20)}, mode=mode)
        with pytest.raises(UploadTooLargeError, match="for its size"):
            read_bytes(tmp_path, bomb, limits)


def test_entries_that_lie_over_each_other_are_refused() -> None:
    """Each is within the ratio, but one place in the file serves for all."""
    data = zipped({f"{n}.off": bytes(190) + random.Random(2).randbytes(10) for n in range(3)})
    limits = ArchiveLimits(entries=100, unpacked=1 << 40, entry=1 << 38, ratio=2)
    members = [Member(f"{n}.off", 1 << 30) for n in range(3)]
    with pytest.raises(UploadTooLargeError, match="more than 2 times its size"):
        check_whole(members, limits, entries=3, packed=len(data))


def test_a_long_header_of_a_tar_is_refused_unread(tmp_path: Path) -> None:
    data = tarred({"a" * 2_000_000 + ".off": OFF}, form=tarfile.GNU_FORMAT)
    with pytest.raises(UploadTooLargeError, match="a header of the archive has"):
        read_bytes(tmp_path, data)


def test_a_text_that_reads_like_a_mesh_is_none() -> None:
    points = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    for name in ("a.txt", "a.md", "a.csv", "a.json", "a.mtl", "a.html", "a.gcode", "README"):
        assert why_skipped(name, points)
        assert why_skipped(name, b"OFF\n3 1 0\n")
    assert why_skipped("a", points) is None
    assert why_skipped("notes", b"v 1 of the text\nv 2 too\n") == "file"
    assert why_skipped("switch", b"OFF or on, that is the question\n") == "file"
    assert why_skipped("a.step", b"ISO-10303-21;\nHEADER;\n") not in (None, "file")
    assert why_skipped("a.stl", b"ISO-10303-21;\nHEADER;\n") is None  # it fails with its reason


def test_skipped_files_are_counted_by_what_they_are() -> None:
    assert summarise(["picture", "text", "picture"]) == "2 pictures, 1 text"
    assert summarise(["text", "file", "the file is a STEP model"]) == "1 text, 2 others"
    assert summarise(["file"]) == "1 file"
    assert summarise([]) == ""


def test_a_gltf_file_finds_its_files_wherever_they_lie_in_the_archive(tmp_path: Path) -> None:
    mesh = bumpy_sphere(1)
    for reference, place in (
        ("scene.bin", "model/source/scene.bin"),
        ("../data/scene.bin", "model/data/scene.bin"),
        ("Scene.BIN", "model/source/scene.bin"),
        ("buffers/scene.bin", "scene.bin"),
        ("my%20scene.bin", "model/source/my scene.bin"),
    ):
        document, binary = gltf_with_buffer(mesh, reference)
        data = zipped({place: binary, "model/source/scene.gltf": document, "preview.png": b""})
        found = read_bytes(tmp_path, data)
        assert found[place] == "skipped: buffer"
        assert found["model/source/scene.gltf"].startswith("glTF")
        assert parse(data).mesh.n_faces == mesh.n_faces
    document, binary = gltf_with_buffer(mesh, "../../scene.bin")
    found = read_bytes(tmp_path, zipped({"x/scene.gltf": document, "other.bin": binary}))
    assert found["x/scene.gltf"] == document.decode()  # reading it says what it lacks


def test_an_archive_of_one_mesh_is_read_as_this_mesh() -> None:
    assert parse(zipped({"a/m.off": OFF, "p.png": b""})).format == "off"
    assert parse(tarred({"m.off": OFF}, mode="w:gz"), filename="a.tgz").format == "off"
    assert parse(zipped({"in.zip": zipped({"m.off.gz": gzip.compress(OFF)})})).format == "off"
    with pytest.raises(InvalidMeshError, match=r"several meshes, 'a.off' and 'b.off'"):
        parse(zipped({"a.off": OFF, "b.off": PLY, "c.txt": b""}))
    with pytest.raises(InvalidMeshError, match="no mesh, only 2 pictures, 1 text"):
        parse(zipped({"a.png": b"", "b.jpg": b"", "c.txt": b""}))
    with pytest.raises(InvalidMeshError, match="the archive is empty"):
        parse(zipped({}))


def test_formats_that_are_zip_archives_are_no_archives() -> None:
    amf = b'<?xml version="1.0"?><amf unit="millimeter"></amf>'
    cases = {
        "a.amf": (zipped({"a.amf": amf}), None),
        "b.zip": (zipped({"a.amf": amf, "b.off": OFF}), "zip"),
        "c.3mf": (zipped({"3D/3dmodel.model": b"<model/>"}), None),
        "d.docx": (zipped({"word/document.xml": b"<w/>"}), None),
        "e.usdz": (zipped({"scene.usdc": b"PXR-USDC"}), None),
        "f.bin": (zipped({"a.off": OFF}), "zip"),
    }
    for name, (data, kind) in cases.items():
        assert archive_kind(io.BytesIO(data), name) == kind, name
