"""``proteus prune``, and what doctor says of it."""

import json
import os
import time
from pathlib import Path

from proteus.cli.prune import size_text
from tests.meshes import box
from tests.proteus.conftest import Run, upload_files
from tests.proteus.real_service import Fault, RealService
from workers.geometry.formats import write


def leave_garbage(service: RealService, name: str) -> None:
    """Upload a shape into a collection of its own, delete that, and let all files be old."""
    with service.client() as client:
        upload_files(client, name, {"box.off": write(box(1.0, 2.0, float(len(name))), "off")})
        client.request("DELETE", f"/v1/collections/{name}")
    for path in (service.settings.data_path / "blobs").rglob("*"):
        os.utime(path, (time.time() - 365 * 86_400,) * 2)


def test_prune_shows_what_can_be_freed_then_frees_it(run: Run, service: RealService) -> None:
    leave_garbage(service, "garbage")
    shown = json.loads(run("prune", "--dry-run", "--json").stdout)
    counts = {kind["kind"]: kind["count"] for kind in shown["kinds"]}
    assert counts["meshes"] == 1
    assert "deleted shapes" in run("prune", "--dry-run").stdout
    result = run("prune")
    assert result.exit_code == 0
    assert "meshes" in result.stdout
    job = json.loads(run("prune", "--json").stdout)
    assert (job["state"], job["result"]["count"]) == ("succeeded", 0)


def test_doctor_says_how_much_can_be_freed(run: Run, service: RealService, tmp_path: Path) -> None:
    def found() -> str:
        result = run("doctor", "--data-dir", tmp_path / "new", "--json")
        checks = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
        return str(checks["can be freed"]["found"])

    leave_garbage(service, "more garbage".replace(" ", "-"))
    assert "meshes 1 (" in found()
    run("prune")
    assert found() == "nothing"
    service.faults.append(Fault(403, "{}", path="/v1/prune"))
    assert "admin" in found()


def test_sizes_are_read_easily() -> None:
    sizes = [0, 999, 1000, 123_456, 5_000_000, 7_200_000_000, 3 * 10**12]
    assert [size_text(size) for size in sizes] == [
        "0 B", "999 B", "1.0 kB", "123.5 kB", "5.0 MB", "7.2 GB", "3.0 TB",
    ]  # fmt: skip
