"""Archives: what is a mesh, what is passed over, and what is refused by name."""

import io
import stat
import zipfile
from pathlib import Path

import pytest

from workers.errors import UnsupportedFormatError, UploadTooLargeError
from workers.pipeline.archives import Entry, read_archive
from workers.settings import Settings
from workers.storage.parts import Failure

LIMITS = Settings(max_zip_entries=10, max_zip_bytes=1_000_000, max_upload_bytes=200_000)


def write_zip(folder: Path, entries: dict[str, bytes | zipfile.ZipInfo]) -> Path:
    path = folder / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            if isinstance(data, zipfile.ZipInfo):
                archive.writestr(data, b"target")
            else:
                archive.writestr(name, data)
    return path


def read(path: Path) -> dict[str, str]:
    found = {}
    for item in read_archive(path, LIMITS):
        if isinstance(item, Entry):
            found[item.name] = item.data.decode(errors="replace")
        else:
            found[item.item] = f"refused: {item.detail}"
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
        },
    )
    assert read(path) == {"cats/a.off": "OFF a", "odd.ending": "tried"}


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


def test_links_and_archives_within_archives_are_refused(tmp_path: Path) -> None:
    link = zipfile.ZipInfo("link.off")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("a.off", b"OFF")
    found = read(write_zip(tmp_path, {"link.off": link, "inner.zip": inner.getvalue()}))
    assert "expected a regular file" in found["link.off"]
    assert "archive within the archive" in found["inner.zip"]


def test_too_many_entries_or_bytes_refuse_the_whole(tmp_path: Path) -> None:
    with pytest.raises(UploadTooLargeError, match="11 entries, allowed are 10"):
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
    assert isinstance(next(iter(read_archive(path, LIMITS))), Failure)
