"""The fake service of the clients' tests, with models, evaluations and signatures."""

import json
import re
from typing import Any

import httpx
import numpy as np

from tests.meshes import icosphere
from tests.proteus.fake_service import TIME, FakeService, answer, problem
from workers.geometry.formats import write
from workers.geometry.formats.naming import read_name

Document = dict[str, Any]
EIGENVALUES = np.geomspace(0.5, 500.0, 60)
BEST_TIME = 0.1


class LearningService(FakeService):
    """Every training succeeds, every heat kernel has K² = exp(-2tλ), every other one 1/λ.

    The first model of an evaluation has 50 per cent in every row, each further one 10 more. What
    ``unknown`` matches cannot be described under a spline.
    """

    def __init__(self) -> None:
        super().__init__()
        self.models = {name: built_in(name) for name in ("commute-time", "heat", "proteus")}
        self.evaluations: dict[str, Document] = {}
        self.unknown = "$^"
        self.failing: set[str] = set()

    def handle(self, request: httpx.Request) -> httpx.Response:
        routes = [
            ("POST", r"/v1/models", self.create_model),
            ("GET", r"/v1/models/([^/]+)", self.show_model),
            ("DELETE", r"/v1/models/([^/]+)", self.delete_model),
            ("POST", r"/v1/evaluations", self.create_evaluation),
            ("GET", r"/v1/evaluations/([^/]+)", lambda _, name: answer(self.evaluations[name])),
            ("GET", r"/v1/shapes/([^/]+)/mesh", lambda _, __: httpx.Response(200, content=GLB)),
            ("GET", r"/v1/shapes/([^/]+)/signature", lambda _, __: httpx.Response(200, content=K)),
        ]
        for method, pattern, handler in routes:
            match = re.fullmatch(pattern, request.url.path)
            if match and method == request.method:
                self.requests.append(request)
                answered: httpx.Response = handler(request, *match.groups())  # type: ignore[operator]
                return answered
        return super().handle(request)

    def create_collection(self, request: httpx.Request) -> httpx.Response:
        made = super().create_collection(request)
        body = json.loads(request.content)
        self.collections[body["name"]]["model"] = body.get("model", "heat")
        return made

    def add_shape(self, collection: str, name: str, label: str, content: bytes) -> Document:
        known = [
            s for s in self.shapes.values() if (s["collection"], s["name"]) == (collection, name)
        ]
        if known:
            return known[0]
        shape = super().add_shape(collection, name, label, content)
        naming = read_name(name)
        shape |= {"label": naming.label, "transformation": naming.transformation}
        shape |= {"strength": naming.strength}
        learned = "learned" in self.collections[collection]["model"]
        if learned and re.search(self.unknown, name):
            shape["state"] = "failed"
        self.collections[collection]["shape_count"] += 1
        return shape

    def list_shapes(self, request: httpx.Request, collection: str) -> httpx.Response:
        found = json.loads(super().list_shapes(request, collection).content)
        state = request.url.params.get("state")
        found["items"] = [s for s in found["items"] if state in (None, s["state"])]
        return answer(found)

    def create_model(self, request: httpx.Request) -> httpx.Response:
        body = json.loads(request.content)
        if body["name"] in self.models:
            return problem(409, "name-taken", f"the model {body['name']} exists")
        time = body["parameters"].get("time", BEST_TIME)
        heat = body["method"].startswith("heat")
        squared = np.exp(-2 * time * EIGENVALUES) if heat else 1.0 / EIGENVALUES
        kernel = {
            "name": "distances", "kind": "heat" if heat else "commute-time",
            "eigenvalues": EIGENVALUES.tolist(), "squared_transfer": squared.tolist(),
            "parameters": {"time": time} if heat else {},
        }  # fmt: skip
        training = body.get("training")
        criterion = {"learned": 0.2, "commute-time": 0.3, "heat": 0.4}
        report = {
            **(training or {}), "classes": ["human", "fish"], "held_out_classes": ["chair"],
            "n_pairs": 6, "trained_range": [1.0, 200.0], "slope": -1.0,
            "criterion": {"training": criterion, "held-out": criterion},
        }  # fmt: skip
        view = body["parameters"].get("view", "closed")
        self.models[body["name"]] = {
            **body, "state": "training" if training else "ready", "channels": [{"view": view}],
            "fusion": {"power": 1.0}, "versions": {"solver": "1"}, "kernels": [kernel],
            "training": report if training else None, "created_at": TIME,
        }  # fmt: skip
        made: Document = {"model": dict(self.models[body["name"]])}
        if training:
            made["job"] = self.new_job("train", "", total=6) | {"model": body["name"]}
        return answer(made, 202)

    def show_model(self, _: httpx.Request, name: str) -> httpx.Response:
        """A training has ended once its model is asked for again."""
        if name not in self.models:
            return problem(404, "model-not-found", f"there is no model {name}")
        if self.models[name]["state"] == "training":
            self.models[name]["state"] = "failed" if name in self.failing else "ready"
        return answer(self.models[name])

    def delete_model(self, _: httpx.Request, name: str) -> httpx.Response:
        del self.models[name]
        return httpx.Response(204)

    def create_evaluation(self, request: httpx.Request) -> httpx.Response:
        body = json.loads(request.content)
        shapes = [s for s in self.shapes.values() if s["collection"] == body["collection"]]
        rows = sorted({s["transformation"] for s in shapes} - {"null", None})
        scores = {model: 50.0 + 10.0 * i for i, model in enumerate(body["models"])}
        skipped = [s for s in shapes if re.search(self.unknown, s["name"])]
        interval = {model: {"value": x, "low": x - 5, "high": x + 5} for model, x in scores.items()}
        found = {
            "id": f"evaluation-{len(self.evaluations)}", "job_id": "job", **body,
            "state": "succeeded", "n_queries": len(shapes), "n_targets": 4, "leave_one_out": False,
            "mean_average_precision": scores, "table": {row: scores for row in rows},
            "by_strength": {row: {"1": scores} for row in rows}, "by_label": {},
            "measures": {model: dict.fromkeys(MEASURES, x) for model, x in scores.items()},
            "precision_recall": {}, "mean_of_rows": interval, "mean_intervals": interval,
            "differences": {
                model: {"mean_of_rows": {"value": x - 50, "low": x - 60, "high": x - 40}}
                for model, x in list(scores.items())[1:]
            },
            "skipped": [{"reason": "not-described", "count": len(skipped), "shapes": skipped}]
            if skipped else [],
            "ranks": [{"query": "shape-0", "model": m, "rank": 1, "top": []} for m in scores],
            "created_at": TIME,
        }  # fmt: skip
        self.evaluations[str(found["id"])] = found
        job = self.new_job("evaluate", body["collection"], total=len(shapes))
        return answer({"evaluation": {**found, "table": {}}, "job": job}, 202)


def built_in(name: str) -> Document:
    """One of the models that are there from the start."""
    return {
        "name": name, "method": name, "state": "ready", "parameters": {}, "training": None,
        "channels": [{"view": "closed"}], "fusion": {"power": 1.0}, "versions": {}, "kernels": [],
    }  # fmt: skip


MEASURES = ("nearest_neighbour", "first_tier", "second_tier", "e_measure", "dcg", "map")
GLB = write(icosphere(2), "glb")
K = (1.0 + icosphere(2).vertices[:, 1]).astype("<f4").tobytes()
