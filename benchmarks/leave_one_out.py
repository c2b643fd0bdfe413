"""Leave-one-out retrieval of a labelled collection, asked of a running service.

``python -m benchmarks.leave_one_out --collection real --models heat commute-time shape-dna``

Every labelled shape is a query against all others; shapes without a label stand among them
and are never right. The collection is moved to each model in turn, and back at the end.
"""

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from workers.retrieval.measures import retrieval_measures

PAGE = 500
BATCH = 50
MEASURES = ("nearest_neighbour", "first_tier", "average_precision")


def shapes_of(client: httpx.Client, collection: str) -> list[dict[str, Any]]:
    """All shapes of a collection that can be found."""
    return list(_pages(client, f"/v1/collections/{collection}/shapes", state="ready"))


def _pages(client: httpx.Client, path: str, **parameters: str) -> Iterator[dict[str, Any]]:
    cursor: str | None = None
    while True:
        query = {"limit": str(PAGE), **parameters, **({"cursor": cursor} if cursor else {})}
        page = client.get(path, params=query).raise_for_status().json()
        yield from page["items"]
        cursor = page["next_cursor"]
        if cursor is None:
            return


def activate(client: httpx.Client, collection: str, model: str) -> None:
    """Move a collection to a model and wait until it is there."""
    answer = client.put(f"/v1/collections/{collection}/model", json={"model": model})
    job = answer.raise_for_status().json()["job"]
    while job["state"] in {"queued", "running"}:
        time.sleep(0.2)
        job = client.get(f"/v1/jobs/{job['id']}").raise_for_status().json()
    if job["state"] != "succeeded":
        raise SystemExit(f"{model}: the job {job['state']}: {job['errors']}")


def rankings(
    client: httpx.Client, collection: str, queries: Sequence[str], limit: int
) -> Iterator[list[str]]:
    """Ids of the matches of each query, the nearest first."""
    for start in range(0, len(queries), BATCH):
        body = [{"shape_id": i, "limit": limit} for i in queries[start : start + BATCH]]
        path = f"/v1/collections/{collection}/query/batch"
        answer = client.post(path, json={"queries": body}).raise_for_status().json()
        for result in answer["results"]:
            yield [match["shape"]["id"] for match in result["matches"]]


def measure(
    shapes: Sequence[dict[str, Any]], ranked: Sequence[list[str]], queries: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Measures by label, and ``mean`` over all queries; in per cent."""
    label = {shape["id"]: shape["label"] for shape in shapes}
    size = {name: sum(other == name for other in label.values()) for name in label.values()}
    by_label: dict[str, list[list[float]]] = {}
    for query, matches in zip(queries, ranked, strict=True):
        relevant = np.array([label[match] == label[query] for match in matches])
        found = retrieval_measures(relevant, n_relevant=size[label[query]] - 1)
        by_label.setdefault(label[query], []).append([getattr(found, name) for name in MEASURES])
    everything = [row for rows in by_label.values() for row in rows]
    table = {name: rows for name, rows in sorted(by_label.items())} | {"mean": everything}
    return {
        name: dict(zip(MEASURES, (100 * np.mean(rows, axis=0)).tolist(), strict=True))
        for name, rows in table.items()
    }


def show(console: Console, results: dict[str, dict[str, dict[str, float]]]) -> None:
    """Print nearest neighbour, first tier and mean average precision by class and model."""
    table = Table(title="leave one out, per cent")
    table.add_column("class")
    for model in results:
        table.add_column(f"{model}\n   NN    FT   mAP", justify="right", no_wrap=True)
    for name in next(iter(results.values())):
        cells = [" ".join(f"{rows[name][m]:5.1f}" for m in MEASURES) for rows in results.values()]
        table.add_row(name, *cells, style="bold" * (name == "mean"))
    console.print(table)


def main() -> None:
    """Measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description="leave-one-out retrieval of a collection")
    parser.add_argument("--url", default="http://127.0.0.1:8000")
    parser.add_argument("--collection", default="default")
    parser.add_argument("--models", nargs="+", default=["heat", "commute-time", "shape-dna"])
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    console = Console()
    with httpx.Client(base_url=options.url, timeout=120) as client:
        path = f"/v1/collections/{options.collection}"
        before = client.get(path).raise_for_status().json()["model"]
        shapes = shapes_of(client, options.collection)
        labels = [shape["label"] for shape in shapes if shape["label"]]
        queries = [s["id"] for s in shapes if s["label"] and labels.count(s["label"]) > 1]
        if not queries:
            raise SystemExit("the collection has no label with two shapes that can be found")
        results = {}
        with Progress(console=Console(stderr=True), transient=True) as progress:
            bar = progress.add_task("asking", total=len(options.models) * len(queries))
            for model in options.models:
                activate(client, options.collection, model)
                ranked = []
                for matches in rankings(client, options.collection, queries, len(shapes)):
                    ranked.append(matches)
                    progress.advance(bar)
                results[model] = measure(shapes, ranked, queries)
        activate(client, options.collection, before)
    console.print(f"{len(queries)} queries, {len(shapes)} shapes, {len(set(labels))} classes")
    show(console, results)
    if options.out is not None:
        options.out.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
