"""A small service in memory that answers as the contract says, for tests of its clients."""

import email.message
import email.policy
import hashlib
import json
import re
from collections.abc import Callable
from email.parser import BytesParser
from typing import Any

import httpx
from typer.testing import Result

Document = dict[str, Any]
Run = Callable[..., Result]
"""The command line: its arguments, and what came of them."""
TIME = "2026-01-01T00:00:00Z"


class FakeService:
    """Collections, shapes and jobs in dictionaries; a job ends when it was asked after twice.

    A file whose content begins with ``bad`` becomes a failed shape; one that begins with
    ``huge`` makes its whole request refused.
    """

    def __init__(self) -> None:
        self.describe_errors: list[Document] = []
        self.collections: dict[str, Document] = {}
        self.shapes: dict[str, Document] = {}
        self.jobs: dict[str, Document] = {}
        self.requests: list[httpx.Request] = []
        self.failures: list[Exception | httpx.Response] = []
        self.uploads: list[tuple[str, list[str]]] = []
        self.queries: list[Document] = []
        self.query_is_slow = False
        self.models: dict[str, Document] = {}
        self.evaluation: Document = {}

    def transport(self) -> httpx.MockTransport:
        return httpx.MockTransport(self.handle)

    def handle(self, request: httpx.Request) -> httpx.Response:
        request.read()
        self.requests.append(request)
        if self.failures:
            failure = self.failures.pop(0)
            if isinstance(failure, Exception):
                raise failure
            return failure
        routes: list[tuple[str, str, Callable[..., httpx.Response]]] = [
            ("GET", r"/healthz", lambda _: answer({"status": "ok"})),
            ("GET", r"/readyz", lambda _: answer({"status": "ok", "checks": {"database": "ok"}})),
            ("GET", r"/v1/collections", self.list_collections),
            ("POST", r"/v1/collections", self.create_collection),
            ("GET", r"/v1/collections/([^/]+)", self.show_collection),
            ("DELETE", r"/v1/collections/([^/]+)", self.delete_collection),
            ("POST", r"/v1/collections/([^/]+)/shapes", self.upload),
            ("GET", r"/v1/collections/([^/]+)/shapes", self.list_shapes),
            ("PUT", r"/v1/collections/([^/]+)/model", self.activate),
            ("POST", r"/v1/collections/([^/]+)/query", self.query_shape),
            ("POST", r"/v1/collections/([^/]+)/query/mesh", self.query_mesh),
            ("GET", r"/v1/queries/([^/]+)", lambda _, __: answer(self.result({}))),
            ("GET", r"/v1/shapes/([^/]+)", self.show_shape),
            ("DELETE", r"/v1/shapes/([^/]+)", self.delete_shape),
            ("GET", r"/v1/shapes/([^/]+)/mesh", lambda _, __: httpx.Response(200, content=b"OFF")),
            ("POST", r"/v1/evaluations", self.evaluate),
            ("GET", r"/v1/evaluations/([^/]+)", lambda _, __: answer(self.evaluation)),
            ("GET", r"/v1/jobs", lambda _: answer(page(list(self.jobs.values())))),
            ("GET", r"/v1/jobs/([^/]+)", self.show_job),
            ("POST", r"/v1/jobs/([^/]+)/(cancel|retry)", self.change_job),
            ("GET", r"/v1/models", lambda _: answer(page([MODEL]))),
            ("POST", r"/v1/models", self.train),
            ("GET", r"/v1/models/([^/]+)", lambda _, name: answer(self.models.get(name, MODEL))),
        ]
        for method, pattern, handler in routes:
            match = re.fullmatch(pattern, request.url.path)
            if match and method == request.method:
                return handler(request, *match.groups())
        return problem(404, "not-found", f"nothing at {request.url.path}")

    # -- collections -----------------------------------------------------------------------

    def list_collections(self, request: httpx.Request) -> httpx.Response:
        """One collection a page, so that paging is needed."""
        names = sorted(self.collections)
        start = int(request.url.params.get("cursor", 0))
        items = [self.collections[name] for name in names[start : start + 1]]
        more = str(start + 1) if start + 1 < len(names) else None
        return answer({"items": items, "next_cursor": more})

    def create_collection(self, request: httpx.Request) -> httpx.Response:
        body = json.loads(request.content)
        if body["name"] in self.collections:
            return problem(409, "name-taken", f"the collection {body['name']} exists")
        made = {
            "name": body["name"], "description": body.get("description"), "model": "heat",
            "shape_count": 0, "ready_count": 0, "failed_count": 0, "created_at": TIME,
        }  # fmt: skip
        self.collections[body["name"]] = made
        return answer(made, 201)

    def show_collection(self, _: httpx.Request, name: str) -> httpx.Response:
        if name not in self.collections:
            return problem(404, "collection-not-found", f"there is no collection {name}")
        return answer(self.collections[name])

    def delete_collection(self, _: httpx.Request, name: str) -> httpx.Response:
        del self.collections[name]
        return httpx.Response(204)

    def activate(self, request: httpx.Request, name: str) -> httpx.Response:
        self.collections[name]["model"] = json.loads(request.content)["model"]
        job = self.new_job("describe", name, total=4, errors=self.describe_errors)
        return answer({"job": job}, 202)

    # -- shapes ----------------------------------------------------------------------------

    def upload(self, request: httpx.Request, collection: str) -> httpx.Response:
        parts = read_multipart(request)
        label = next((text.decode() for name, _, text in parts if name == "label"), "")
        files = [(filename, content) for name, filename, content in parts if name == "files"]
        if any(content.startswith(b"huge") for _, content in files):
            return problem(413, "upload-too-large", "a file has 9 bytes, more than the limit of 4")
        self.uploads.append((label, [filename for filename, _ in files]))
        errors = [
            {"item": filename, "type": "/problems/invalid-mesh", "detail": "it has no faces"}
            for filename, content in files
            if content.startswith(b"bad")
        ]
        shapes = [self.add_shape(collection, filename, label, text) for filename, text in files]
        job = self.new_job("ingest", collection, total=len(files), errors=errors)
        return answer({"job": job, "shapes": shapes}, 202)

    def add_shape(self, collection: str, name: str, label: str, content: bytes) -> Document:
        sha256 = hashlib.sha256(content).hexdigest()
        shape: Document = {
            "id": f"shape-{len(self.shapes)}", "collection": collection, "name": name,
            "label": label or None, "transformation": None, "strength": None, "metadata": {},
            "sha256": sha256, "format": "off", "n_vertices": 4, "n_faces": 4, "area": 1.0,
            "n_components": 1, "n_boundary_loops": 0, "repairs": [], "state": "ready",
            "error": None, "created_at": TIME,
        }  # fmt: skip
        self.shapes[str(shape["id"])] = shape
        return shape

    def list_shapes(self, request: httpx.Request, collection: str) -> httpx.Response:
        label = request.url.params.get("label")
        found = [s for s in self.shapes.values() if s["collection"] == collection]
        return answer(page([s for s in found if label is None or s["label"] == label]))

    def show_shape(self, _: httpx.Request, identifier: str) -> httpx.Response:
        if identifier not in self.shapes:
            return problem(404, "shape-not-found", f"there is no shape {identifier}")
        return answer(self.shapes[identifier])

    def delete_shape(self, _: httpx.Request, identifier: str) -> httpx.Response:
        del self.shapes[identifier]
        return httpx.Response(204)

    # -- queries ---------------------------------------------------------------------------

    def query_shape(self, request: httpx.Request, _: str) -> httpx.Response:
        self.queries.append(json.loads(request.content))
        return answer(self.result({"shape_id": self.queries[-1]["shape_id"]}))

    def query_mesh(self, request: httpx.Request, _: str) -> httpx.Response:
        self.queries.append({name: content for name, _, content in read_multipart(request)})
        if self.query_is_slow:
            job = self.new_job("query", "default", total=1)
            return answer({"job": job, "query_id": "query-0"}, 202)
        return answer(self.result({"sha256": "0" * 64}))

    def result(self, query: Document) -> Document:
        matches = [
            {"rank": rank, "distance": 0.125 * rank, "similarity": 0.5, "shape": shape}
            for rank, shape in enumerate(self.shapes.values(), 1)
        ]
        return {
            "collection": "default", "model": "heat", "dissimilarity": "l1", "query": query,
            "matches": matches, "searched": len(self.shapes), "took_ms": 1.5,
        }  # fmt: skip

    def evaluate(self, request: httpx.Request) -> httpx.Response:
        """Accept whatever is asked; what is answered then is ``evaluation``."""
        self.queries.append(json.loads(request.content))
        job = self.new_job("evaluate", self.queries[-1]["collection"], total=9)
        return answer({"evaluation": {"id": "evaluation-0"}, "job": job}, 202)

    def train(self, request: httpx.Request) -> httpx.Response:
        """Accept whatever is asked; the model is then ready with ``REPORT``."""
        self.queries.append(json.loads(request.content))
        name, method = self.queries[-1]["name"], self.queries[-1]["method"]
        learned = "training" in self.queries[-1]
        job = self.new_job("train", "", total=5 * learned)
        job["state"] = "queued" if learned else "succeeded"
        report = (BANK_REPORT if method == "bank" else REPORT) if learned else None
        self.models[name] = {**MODEL, "name": name, "method": method, "training": report}
        return answer({"model": self.models[name], "job": job}, 202)

    # -- jobs ------------------------------------------------------------------------------

    def new_job(
        self, kind: str, collection: str, *, total: int, errors: list[Document] | None = None
    ) -> Document:
        job = {
            "id": f"job-{len(self.jobs)}", "kind": kind, "state": "queued",
            "progress": {"done": 0, "total": total, "unit": "shapes"}, "errors": [],
            "attempts": 1, "collection": collection, "model": None, "created_at": TIME,
            "started_at": None, "finished_at": None,
        }  # fmt: skip
        self.jobs[str(job["id"])] = job
        self._later = {**getattr(self, "_later", {}), job["id"]: errors or []}
        return dict(job)

    def show_job(self, request: httpx.Request, identifier: str) -> httpx.Response:
        if identifier not in self.jobs:
            return problem(404, "job-not-found", f"there is no job {identifier}")
        job = self.jobs[identifier]
        if job["state"] == "running":
            failed = len(self._later[identifier])
            all_failed = failed > 0 and failed >= job["progress"]["total"]
            job["state"] = "failed" if all_failed else "succeeded"
            job["errors"] = self._later[identifier]
            job["progress"] = {**job["progress"], "done": job["progress"]["total"]}
        if job["state"] == "queued":
            job["state"] = "running"
        etag = f'"{job["state"]}"'
        if request.headers.get("If-None-Match") == etag:
            return httpx.Response(304, headers={"ETag": etag})
        return answer(job, headers={"ETag": etag, "Retry-After": "0"})

    def change_job(self, _: httpx.Request, identifier: str, action: str) -> httpx.Response:
        self.jobs[identifier]["state"] = "cancelled" if action == "cancel" else "queued"
        return answer(self.jobs[identifier])


MODEL: Document = {
    "name": "heat", "method": "heat", "state": "ready", "parameters": {"time": 0.15},
    "views": [{
        "name": "closed", "eigenpairs": 100,
        "steps": [
            {"name": "cap-holes", "parameters": {"longest": 50.0}},
            {"name": "smooth", "parameters": {"time": 0.0003, "steps": 3.0}},
        ],
    }],
    "channels": [{
        "name": "heat", "view": "closed", "kernel": {}, "feature": "distance-distribution",
        "normalisation": "none", "edges": [0, 1], "dissimilarity": "l1", "scale": 1.0,
        "weight": 1.0,
    }],
    "fusion": {"power": 1.0}, "versions": {}, "kernels": [], "training": None, "created_at": TIME,
}  # fmt: skip


REPORT: Document = {
    "criterion": {
        "training": {"learned": 0.011, "commute-time": 0.022, "heat": 0.033, "closed-form": 0.01},
        "held-out": {"learned": 0.044, "commute-time": 0.055, "heat": 0.066, "closed-form": 0.05},
    },
    "heat_time": 0.217, "slope": -1.15, "trained_range": [1.0, 230.0], "unit": "first-eigenvalue",
    "n_pairs": 4, "n_held_out_pairs": 1, "n_failed_pairs": 0,
}  # fmt: skip


BANK_REPORT: Document = {
    "n_references": 60, "n_queries": 3300, "n_groups": 21, "n_failed_variants": 2,
    "n_candidates": 97, "share_that_sees_scale": 0.0,
    "rows": {
        "training": {"map": {"holes": 97.13, "noise": 88.21}, "mean": 92.67, "interval": None},
        "held_out": {
            "map": {"holes": 95.46, "noise": 84.37}, "mean": 89.92, "interval": [86.11, 93.24],
        },
    },
    "ablation": [{"channel": "heat", "weight": 1.0, "lost": 3.72}],
    "similarity": [{"promised": 0.01, "found": 0.013}],
}  # fmt: skip


def answer(
    document: Document, status: int = 200, headers: dict[str, str] | None = None
) -> httpx.Response:
    return httpx.Response(status, json=document, headers=headers)


def page(items: list[Document]) -> Document:
    return {"items": items, "next_cursor": None}


def problem(status: int, kind: str, detail: str) -> httpx.Response:
    body = {
        "type": f"/problems/{kind}", "title": kind.replace("-", " "), "status": status,
        "detail": detail, "request_id": "request-17",
    }  # fmt: skip
    return httpx.Response(status, json=body, headers={"Content-Type": "application/problem+json"})


def read_multipart(request: httpx.Request) -> list[tuple[str, str, bytes]]:
    """Return name, filename and content of each part."""
    head = f"Content-Type: {request.headers['Content-Type']}\r\n\r\n".encode()
    message = BytesParser(policy=email.policy.HTTP).parsebytes(head + request.content)
    parts = []
    for part in message.iter_parts():
        assert isinstance(part, email.message.EmailMessage)
        name = part.get_param("name", header="Content-Disposition")
        content = part.get_payload(decode=True)
        assert isinstance(content, bytes)
        parts.append((str(name), part.get_filename() or "", content))
    return parts
