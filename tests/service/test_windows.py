"""Searches that compare windows: the same answers by every way, and the cache of signatures."""

import shutil
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from service.search import ranking
from service.search.indexes import SearchIndexes, SearchModel, load_search_model
from tests.meshes import bumpy_sphere, icosphere, octahedron, rectangle, scaled, translated, union
from tests.pipeline.windowed import store_windowed
from tests.retrieval.test_points import LOCAL
from tests.service.conftest import Start, Stock
from tests.service.running import (
    ZOO,
    Api,
    Json,
    closing_database,
    make_settings,
    off,
    running,
    zoo_files,
)
from workers.retrieval.scan import rerank
from workers.retrieval.windows import candidates, closely, evidence
from workers.retrieval.windows.rows import ROW_BYTES
from workers.storage.collections import create_collection, delete_collection
from workers.storage.database import Database
from workers.storage.descriptors import mark_deleted, store_descriptors
from workers.storage.migrate import migrate
from workers.storage.models import Signature
from workers.transformations import transform

BALL, TWIN, RING, GREY, CRATE = ZOO
PARK = "park"


def make_park(api: Api, files: dict[str, bytes]) -> dict[str, str]:
    """A collection under a model that compares windows; ids by name."""
    with api.services.database.begin() as session:
        vertices = api.settings.working_vertices
        store_windowed(session, ["windowed"], working_vertices=vertices)
    api.post("/v1/collections", 201, json={"name": PARK, "model": "windowed"})
    shapes = api.upload(PARK, files)["shapes"]
    api.work()
    return {shape["name"]: shape["id"] for shape in shapes}


@pytest.fixture(scope="module")
def stocked_park(tmp_path_factory: pytest.TempPathFactory) -> Stock:
    """A data directory with such a collection computed, and ids by name."""
    folder = tmp_path_factory.mktemp("park") / "data"
    settings = make_settings(folder)
    migrate(settings)
    with running(settings) as api:
        return folder, make_park(api, zoo_files())


@pytest.fixture
def park(stocked_park: Stock, tmp_path: Path) -> Iterator[Api]:
    """A service of its own with the collection in it."""
    folder, ids = stocked_park
    shutil.copytree(folder, tmp_path / "park")
    with running(make_settings(tmp_path / "park")) as api:
        api.shape_ids = dict(ids)
        yield api


def without_time(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key != "took_ms"}


def ids_of(answer: Json) -> list[str]:
    return [match["shape"]["id"] for match in answer["matches"]]


def test_a_shape_and_its_mesh_are_compared_closely_and_answered_twice_the_same(
    park: Api, start: Start
) -> None:
    ids = park.shape_ids
    by_shape = [park.ask(PARK, shape_id=ids[BALL]) for _ in range(2)]
    assert without_time(by_shape[0]) == without_time(by_shape[1])
    assert (by_shape[0]["searched"], by_shape[0]["searched_closely"]) == (4, 4)
    assert ids_of(by_shape[0])[0] == ids[TWIN]
    assert by_shape[0]["matches"][0]["distance"] < 0.5 * by_shape[0]["matches"][1]["distance"]
    by_mesh = park.ask_mesh(PARK, zoo_files()[BALL])
    again = park.ask_mesh(PARK, zoo_files()[BALL])
    assert without_time(by_mesh) == without_time(again)
    assert (by_mesh["searched"], by_mesh["searched_closely"]) == (5, 5)
    assert set(ids_of(by_mesh)[:2]) == {ids[BALL], ids[TWIN]}
    url = park.settings.resolved_database_url
    replica = start("replica", database_url=url, blob_url=park.settings.resolved_blob_url)
    assert without_time(replica.ask(PARK, shape_id=ids[BALL])) == without_time(by_shape[0])


def test_a_mesh_that_is_new_has_the_answer_that_its_upload_has_later(park: Api) -> None:
    """The worker takes the windows of a query, the API those of a stored shape."""
    ids = park.shape_ids
    egg = off(bumpy_sphere(2, seed=5))
    waiting = park.ask_mesh(PARK, egg, 202)
    park.work()
    answer = park.get(f"/v1/queries/{waiting['query_id']}")
    assert (answer["searched"], answer["searched_closely"]) == (5, 5)
    uploaded = park.upload(PARK, {"egg.off": egg})["shapes"][0]["id"]
    park.work()
    stored = park.ask(PARK, shape_id=uploaded)
    assert stored["matches"] == answer["matches"]
    assert set(ids_of(stored)) == set(ids.values())


def test_all_that_is_compared_closely_has_its_points_compared(
    api: Api, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not the nearest of the scan alone: a whole that windows find may lie far behind them."""
    vertices = api.settings.working_vertices
    with api.services.database.begin() as session:
        store_windowed(session, ["pointed"], working_vertices=vertices, more=(LOCAL,))
    api.post("/v1/collections", 201, json={"name": PARK, "model": "pointed"})
    ids = {shape["name"]: shape["id"] for shape in api.upload(PARK, zoo_files())["shapes"]}
    api.work()
    answer = api.ask(PARK, shape_id=ids[BALL])
    monkeypatch.setattr(ranking, "rerank", partial(rerank, depth=1))
    assert api.ask(PARK, shape_id=ids[BALL])["matches"] == answer["matches"]


def test_without_windows_nothing_is_compared_closely(zoo: Api) -> None:
    ball = zoo.shape_ids[BALL]
    answer = zoo.ask("zoo", shape_id=ball)
    assert (answer["searched"], answer["searched_closely"]) == (4, 0)
    for match in ("whole", "part"):
        asked = zoo.ask("zoo", shape_id=ball, match=match)
        assert without_time(asked) == without_time(answer)
    zoo.services.indexes.close()
    assert not (zoo.settings.data_path / "cache" / "windows").exists()


def test_a_dissimilarity_that_is_chosen_is_all_that_counts(park: Api) -> None:
    ids = park.shape_ids
    chosen = park.ask(PARK, shape_id=ids[BALL], dissimilarity="l1")
    assert (chosen["searched"], chosen["searched_closely"]) == (4, 0)


def test_a_filter_leaves_what_is_known_of_the_others_as_it_is(park: Api) -> None:
    ids = park.shape_ids
    whole = park.ask(PARK, shape_id=ids[CRATE])
    wanted = {"must": [{"field": "label", "equals": "ball"}]}
    some = park.ask(PARK, shape_id=ids[CRATE], filter=wanted)
    kept = [m["distance"] for m in whole["matches"] if m["shape"]["label"] == "ball"]
    assert [match["distance"] for match in some["matches"]] == kept
    assert some["searched_closely"] == some["searched"] == 2


def test_deleted_shapes_and_those_without_a_signature_are_not_compared_closely(park: Api) -> None:
    ids = park.shape_ids
    before = park.ask(PARK, shape_id=ids[BALL])
    with park.services.database.begin() as session:
        session.delete(session.get_one(Signature, (ids[GREY], "windowed")))
    park.services.indexes.forget_model("windowed")  # rows are never removed so in a feed
    fewer = park.ask(PARK, shape_id=ids[BALL])
    assert (fewer["searched"], fewer["searched_closely"]) == (4, 3)
    then = {match["shape"]["id"]: match["distance"] for match in before["matches"]}
    now = {match["shape"]["id"]: match["distance"] for match in fewer["matches"]}
    assert now.pop(ids[GREY]) != then.pop(ids[GREY])  # by its descriptor alone
    assert now == then
    park.delete(f"/v1/shapes/{ids[RING]}")
    left = park.ask(PARK, shape_id=ids[BALL])
    assert (left["searched"], left["searched_closely"]) == (3, 2)
    assert ids[RING] not in ids_of(left)


def test_what_a_query_stands_for_changes_how_it_is_compared(park: Api) -> None:
    ids = park.shape_ids
    part = off(transform(bumpy_sphere(3, seed=2), "partial", 3, seed=1).mesh)
    waiting = park.ask_mesh(PARK, part, 202)
    park.work()
    auto = park.get(f"/v1/queries/{waiting['query_id']}")
    answers = {match: park.ask_mesh(PARK, part, match=match) for match in ("auto", "whole", "part")}
    assert answers["auto"]["matches"] == auto["matches"]
    assert auto["matches"][0]["shape"]["id"] == ids[GREY]
    far = {name: [m["distance"] for m in answer["matches"]] for name, answer in answers.items()}
    assert far["whole"] != far["auto"]
    assert all(answer["searched_closely"] == 5 for answer in answers.values())


def test_a_region_of_a_shape_finds_it_by_its_windows(park: Api) -> None:
    """A region is a part, cut on the server; it may find the shape that it is cut from."""
    ring = park.shape_ids[RING]
    body = {"shape_id": ring, "region": {"center": 0, "radius": 2.0}}
    waiting = park.post(f"/v1/collections/{PARK}/query?wait=0", 202, json=body)
    park.work()
    answer = park.get(f"/v1/queries/{waiting['query_id']}")
    assert (answer["searched"], answer["searched_closely"]) == (5, 5)
    assert ids_of(answer)[0] == ring
    assert park.ask(PARK, **body)["matches"] == answer["matches"]
    others = park.ask(PARK, **body, include_self=False)
    assert (others["searched"], others["searched_closely"]) == (4, 4)
    assert others["matches"] == [
        {**match, "rank": rank} for rank, match in enumerate(answer["matches"][1:], start=1)
    ]


def test_a_batch_compares_closely_as_single_questions_do(park: Api) -> None:
    questions = [{"shape_id": park.shape_ids[name]} for name in (BALL, CRATE)]
    batch = park.post(f"/v1/collections/{PARK}/query/batch", json={"queries": questions})
    for question, answer in zip(questions, batch["results"], strict=True):
        assert without_time(answer) == without_time(park.ask(PARK, **question))
        assert answer["searched_closely"] == 4


def numbered_names() -> dict[str, bytes]:
    """Poses of three labels: to be measured leave-one-out, and by the rest."""
    return {
        f"{label}/{n}.off": off(transform(bumpy_sphere(2, seed), "noise", 1, seed=n).mesh)
        for seed, label in enumerate(("cat", "dog", "owl"))
        for n in range(2)
    }


def test_an_evaluation_ranks_as_searches_do(api: Api, monkeypatch: pytest.MonkeyPatch) -> None:
    """Few are compared closely, so that it matters which: a query is not among them."""
    monkeypatch.setattr(closely, "NEAREST", 2)
    monkeypatch.setattr(candidates, "CANDIDATES", 1)
    monkeypatch.setattr(evidence, "VERIFIED", 1)
    make_park(api, numbered_names())
    body = {"collection": PARK, "models": ["windowed", "heat"]}
    accepted = api.post("/v1/evaluations?wait=0", 202, json=body)
    api.work()
    found = api.get(f"/v1/evaluations/{accepted['evaluation']['id']}")
    assert (found["state"], found["n_queries"]) == ("succeeded", 6)
    ranks = {rank["query"]: rank["top"] for rank in found["ranks"] if rank["model"] == "windowed"}
    assert len(ranks) == 6
    for query, top in ranks.items():
        answer = api.ask(PARK, shape_id=query)
        assert 2 <= answer["searched_closely"] <= 3
        assert ids_of(answer) == top


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    settings = make_settings(tmp_path)
    migrate(settings)
    with closing_database(settings.resolved_database_url) as database:
        with database.begin() as session:
            store_windowed(session, ["windowed"], working_vertices=500)
        yield database


def row_of(number: int) -> bytes:
    """Bytes of a signature, as far as an index looks at them; some are no numbers."""
    filled = np.random.default_rng(number).integers(0, 256, ROW_BYTES, dtype=np.uint8)
    filled[:8] = 255
    return filled.tobytes()


def stocked(database: Database, ids: Sequence[str]) -> tuple[str, SearchModel]:
    """A collection whose shapes have signatures, and their model."""
    with database.begin() as session:
        park = create_collection(session, name=PARK, description="", model="windowed").id
        rows = [(name, "windowed", row_of(number)) for number, name in enumerate(ids)]
        store_descriptors(session, park, [], rows)
        return park, load_search_model(session, "windowed")


def cached(folder: Path) -> list[Path]:
    return sorted((folder / "windows").glob("*.index"))


def test_signatures_keep_their_bytes_in_an_index_and_its_file(
    database: Database, tmp_path: Path
) -> None:
    """Rows are kept as numbers, of which any bits may be none."""
    names = [f"shape-{number}" for number in range(5)]
    park, search = stocked(database, names)
    folder = tmp_path / "cache"
    for again in (False, True):
        indexes = SearchIndexes(database, folder)
        assert bool(cached(folder)) == again
        snapshot = indexes.signatures(park, search)
        matrix = snapshot.matrix.view(np.uint8)
        for number, name in enumerate(names):
            (row,) = snapshot.rows_of([name])
            assert matrix[row].tobytes() == row_of(number)
        (rows, size) = indexes.sizes()[park, "windowed"]
        assert rows == 0  # of descriptors there are none
        assert 5 * ROW_BYTES < size < 6 * ROW_BYTES
        indexes.close()


def test_an_index_of_signatures_follows_its_own_feed(database: Database, tmp_path: Path) -> None:
    park, search = stocked(database, ["one", "two"])
    indexes = SearchIndexes(database, tmp_path / "cache")
    before = indexes.signatures(park, search)
    with database.begin() as session:
        store_descriptors(
            session, park, [("three", "windowed", b"\0" * 4 * search.model.dimension)]
        )
        mark_deleted(session, ["one"])
        store_descriptors(session, park, [], [("four", "windowed", row_of(4))])
        store_descriptors(session, park, [], [("five", "windowed", b"too short")])
    after = indexes.signatures(park, search)
    alive = [after.ids[row] for row in after.rows]
    assert sorted(alive) == ["four", "two"]
    assert len(indexes.snapshot(park, search).rows) == 1
    assert [before.ids[row] for row in before.rows] == ["one", "two"]
    indexes.close()


@pytest.mark.parametrize("gone", ["collection", "model", "unknown"])
def test_files_of_signatures_go_with_those_of_descriptors(
    database: Database, tmp_path: Path, gone: str
) -> None:
    folder = tmp_path / "cache"
    park, search = stocked(database, ["one"])
    indexes = SearchIndexes(database, folder)
    indexes.signatures(park, search)
    indexes.close()
    assert len(cached(folder)) == 1
    if gone == "collection":
        with database.begin() as session:
            delete_collection(session, PARK)
        indexes.forget_collection(park)
    elif gone == "model":
        indexes.forget_model("windowed")
    else:
        SearchIndexes(database, folder).keep_only({park}, {"windowed"})
        assert len(cached(folder)) == 1
        SearchIndexes(database, folder).keep_only({park}, {"heat"})
    assert cached(folder) == []


HARD_QUERIES = {
    "ten triangles": rectangle(5, 1),
    "a plate": rectangle(12, 12),
    "a closed sphere": icosphere(3),
    "forty pieces": union(
        *(translated(scaled(octahedron(), 0.1 + 0.01 * i), (2.0 * i, 0.0, 0.0)) for i in range(40))
    ),
    "a part of forty pieces": union(
        *(translated(rectangle(3, 3, 1.0, 0.2 * i), (3.0 * i, 0.0, 0.0)) for i in range(1, 41))
    ),
}


@pytest.mark.parametrize("match", ["auto", "part", "whole"])
def test_what_says_little_is_ranked_all_the_same(park: Api, match: str) -> None:
    """Nothing but a flat rim, the same everywhere, or many pieces: an answer, never an error."""
    for mesh in HARD_QUERIES.values():
        content = off(mesh)
        waiting = park.ask_mesh(PARK, content, 202, match=match)
        park.work()
        answer = park.get(f"/v1/queries/{waiting['query_id']}")
        assert (answer["searched"], answer["searched_closely"]) == (5, 5)
        far = [one["distance"] for one in answer["matches"]]
        assert far == sorted(far)
        assert np.isfinite(far).all()
        assert all(0.0 <= one["similarity"] <= 1.0 for one in answer["matches"])
        assert park.ask_mesh(PARK, content, match=match)["matches"] == answer["matches"]
