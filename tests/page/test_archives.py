"""Archives and folders in a browser: where a shape lay, and what was skipped beside it."""

import io
import json
import re
import zipfile
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.page.conftest import Running, Seen
from tests.page.test_collections import a_collection, fish
from tests.page.test_every_page import serious_faults
from workers.geometry.formats import parse, write

pytestmark = pytest.mark.slow
PICTURE = b"\x89PNG\r\n\x1a\n"
GLB_HEAD = 20


def model_files(path: Path) -> dict[str, bytes]:
    """A mesh as model sites offer it: glTF with its buffer, in a folder with clutter."""
    glb = write(parse(path.read_bytes()).mesh, "glb")
    end = GLB_HEAD + int.from_bytes(glb[12:16], "little")
    document = json.loads(glb[GLB_HEAD:end])
    document["buffers"][0]["uri"] = "scene.bin"
    return {
        "models/fish/scene.gltf": json.dumps(document).encode(),
        "models/fish/scene.bin": glb[end + 8 :],
        "models/fish/preview.png": PICTURE,
        "models/licence.txt": b"Do what you like with it.",
    }


def as_zip(files: dict[str, bytes]) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return target.getvalue()


def expect_skipped(place: Page | Locator) -> None:
    """Files are counted, and named once they are unfolded: the clutter, and nothing that was read.

    Of an archive, buffers that were joined may be named beside it.
    """
    details = place.locator("details.skippedfiles")
    expect(details.get_by_role("cell")).to_have_count(0)
    details.locator("summary").press("Enter")
    expect(details.get_by_role("row", name="models/fish/preview.png Picture.")).to_be_visible()
    expect(details.get_by_role("row", name="models/licence.txt Text.")).to_be_visible()
    expect(details.get_by_role("row", name="gltf")).to_have_count(0)
    named = details.locator("tbody tr").count()
    expect(details.locator("summary")).to_have_text(f"{named} files skipped")


def test_an_archive_of_one_model_is_one_shape(running: Running, seen: Seen, tmp_path: Path) -> None:
    page = seen.page
    a_collection(page, running, "archives")
    archive = tmp_path / "download.zip"
    archive.write_bytes(as_zip(model_files(fish(running, 1))))
    page.get_by_label("Add meshes").first.set_input_files(archive)
    uploads = page.get_by_role("region", name="Uploads")
    expect(uploads).to_contain_text(re.compile("1 of 1 file ready, . skipped"))
    expect_skipped(uploads)
    card = page.get_by_role("listitem").filter(has_text="scene.gltf")
    expect(card).to_contain_text("models/fish")
    expect(page.get_by_role("heading", name="1 shape", exact=True)).to_be_visible()

    assert serious_faults(page) == []

    jobs = page.request.get(f"{running.url}/v1/jobs?collection=archives").json()["items"]
    assert len(jobs) == 1
    page.goto(f"{running.url}/#/jobs/{jobs[0]['id']}")
    expect_skipped(page.get_by_role("main"))
    assert serious_faults(page) == []

    page.goto(f"{running.url}/#/collections/archives")
    card.get_by_role("link", name=re.compile("scene")).click()
    expect(page.locator(".fact", has_text="Path")).to_contain_text("models/fish/scene.gltf")
    expect(page.get_by_role("heading", name="Left alone")).to_be_visible()
    page.get_by_role("main").get_by_role("link", name="models", exact=True).click()
    expect(page.get_by_label("Folder", exact=True)).to_have_value("models")
    expect(page.get_by_role("heading", name="1 shape", exact=True)).to_be_visible()
    page.get_by_label("Folder", exact=True).fill("models/cats")
    page.get_by_label("Folder", exact=True).press("Enter")
    expect(page.get_by_role("heading", name="No shape is like that")).to_be_visible()


def test_a_folder_is_sent_as_an_archive_of_it(running: Running, seen: Seen, tmp_path: Path) -> None:
    page = seen.page
    a_collection(page, running, "folders")
    for name, data in model_files(fish(running, 2)).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    page.get_by_label("Add a folder").first.set_input_files(tmp_path / "models")
    uploads = page.get_by_role("region", name="Uploads")
    expect(uploads).to_contain_text("1 of 1 file ready, 2 skipped")
    expect_skipped(uploads)
    listed = page.request.get(f"{running.url}/v1/collections/folders/shapes").json()["items"]
    assert [(one["path"], one["label"], one["format"]) for one in listed] == [
        ("models/fish/scene.gltf", "fish", "glb")
    ]


def test_what_is_no_mesh_by_its_content_is_skipped_too(
    running: Running, seen: Seen, tmp_path: Path
) -> None:
    page = seen.page
    a_collection(page, running, "unknown")
    unknown = tmp_path / "scan.dat"
    unknown.write_bytes(bytes(range(200, 256)) * 20)
    page.get_by_label("Add meshes").first.set_input_files([unknown, fish(running, 1)])
    uploads = page.get_by_role("region", name="Uploads")
    expect(uploads).to_contain_text("1 of 1 file ready, 1 skipped")
    expect(uploads.locator("summary")).to_have_text("1 file skipped")


def test_a_search_is_narrowed_to_a_folder(running: Running, seen: Seen) -> None:
    page = seen.page
    shape = page.request.get(f"{running.url}/v1/collections/zoo/shapes?limit=1").json()["items"][0]
    page.goto(f"{running.url}/#/search/zoo?shape={shape['id']}")
    page.get_by_label("Filter by").select_option("path")
    expect(page.get_by_label("How", exact=True)).to_have_value("under")
    page.get_by_label("Value", exact=True).fill("spider")
    page.get_by_label("Value", exact=True).press("Enter")
    expect(page.get_by_role("button", name=re.compile("filter path under spider"))).to_be_visible()
    expect(page.locator(".answer[aria-busy=false]")).to_be_visible()
    cards = page.get_by_role("button", name=re.compile(r"^Rank \d+"))
    expect(cards).to_have_count(2)
    assert all("spider" in card.inner_text() for card in cards.all())
