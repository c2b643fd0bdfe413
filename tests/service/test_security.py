"""Keys, scopes and rates: who may do what, and how often."""

import pytest

from service.app import create_app
from service.security import new_key, parse_keys
from tests.service.conftest import Start
from tests.service.running import Api, make_settings
from workers.settings import SettingsError

SHAPE = "/v1/shapes/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"
QUERY = "/v1/queries/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"
JOB = "/v1/jobs/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"
NEEDED = {
    ("GET", "/metrics"): "read",
    ("GET", "/v1/collections"): "read",
    ("POST", "/v1/collections"): "write",
    ("GET", "/v1/collections/zoo"): "read",
    ("PATCH", "/v1/collections/zoo"): "write",
    ("DELETE", "/v1/collections/zoo"): "admin",
    ("PUT", "/v1/collections/zoo/model"): "write",
    ("GET", "/v1/collections/zoo/shapes"): "read",
    ("POST", "/v1/collections/zoo/shapes"): "write",
    ("POST", "/v1/collections/zoo/query"): "read",
    ("POST", "/v1/collections/zoo/query/batch"): "read",
    ("POST", "/v1/collections/zoo/query/mesh"): "read",
    ("GET", QUERY): "read",
    **{("GET", f"{QUERY}/{part}"): "read" for part in ("mesh", "spectrum", "signature")},
    **{("GET", f"{base}/eigenfunction"): "read" for base in (SHAPE, QUERY)},
    ("GET", SHAPE): "read",
    ("PATCH", SHAPE): "write",
    ("DELETE", SHAPE): "write",
    **{("GET", f"{SHAPE}/{part}"): "read" for part in ("mesh", "thumbnail.png", "spectrum")},
    **{("GET", f"{SHAPE}/{part}"): "read" for part in ("signature", "distribution", "comparison")},
    ("GET", "/v1/models"): "read",
    ("POST", "/v1/models"): "write",
    ("GET", "/v1/models/heat"): "read",
    ("DELETE", "/v1/models/heat"): "admin",
    ("POST", "/v1/evaluations"): "write",
    ("GET", "/v1/evaluations"): "read",
    ("GET", "/v1/evaluations/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"): "read",
    ("GET", "/v1/jobs"): "read",
    ("GET", JOB): "read",
    ("POST", f"{JOB}/cancel"): "write",
    ("POST", f"{JOB}/retry"): "write",
    ("GET", f"{JOB}/events"): "read",
}
ALLOWED = {"read": {"read"}, "write": {"read", "write"}, "admin": {"read", "write", "admin"}}


@pytest.fixture
def keys(start: Start) -> tuple[Api, dict[str, str]]:
    """A service with a key of each scope, and the tokens."""
    made = {scope: new_key(f"{scope}-1", [scope]) for scope in ALLOWED}
    api = start(api_keys=", ".join(setting for _, setting in made.values()))
    return api, {scope: token for scope, (token, _) in made.items()}


def test_every_operation_asks_for_its_scope(keys: tuple[Api, dict[str, str]]) -> None:
    api, tokens = keys
    for (method, path), scope in NEEDED.items():
        assert api.client.request(method, path).status_code == 401
        for held, token in tokens.items():
            headers = {"Authorization": f"Bearer {token}"}
            status = api.client.request(method, path, headers=headers).status_code
            assert (status == 403) == (scope not in ALLOWED[held]), (method, path, held, status)
            assert status != 401


def test_no_operation_was_forgotten(api: Api) -> None:
    document = api.get("/openapi.json")
    open_to_all = {"/healthz", "/readyz"}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            assert ("security" in operation) == (path not in open_to_all), (method, path)
    n_operations = sum(len(operations) for operations in document["paths"].values())
    assert n_operations == len(NEEDED) + len(open_to_all)


def test_health_and_documentation_are_open(keys: tuple[Api, dict[str, str]]) -> None:
    api, _ = keys
    for path in ("/healthz", "/readyz", "/openapi.json", "/docs"):
        assert api.client.get(path).status_code == 200


def test_a_key_that_is_not_quite_right_is_refused(keys: tuple[Api, dict[str, str]]) -> None:
    api, tokens = keys
    token = tokens["read"]
    wrong = [
        token[:-1],
        token + "x",
        token.upper(),
        token.replace("read-1", "write-1"),
        token.replace("proteus", "hydra"),
        "proteus_read-1_",
        "proteus__",
        "",
        "é",
        "\x7f" * 10,
    ]
    for given in wrong:
        headers = {"Authorization": f"Bearer {given}".encode()}
        answer = api.client.get("/v1/models", headers=headers)
        assert (answer.status_code, answer.headers["WWW-Authenticate"]) == (401, "Bearer")
        assert answer.json()["type"] == "/problems/unauthorized"
    basic = api.client.get("/v1/models", headers={"Authorization": f"Basic {token}"})
    assert basic.status_code == 401
    assert token not in basic.text


def test_a_new_key_is_known_by_its_hash_alone() -> None:
    token, setting = new_key("ci", ["read", "write"])
    other, _ = new_key("ci", ["read", "write"])
    assert token != other
    assert token.startswith("proteus_ci_")
    assert token.removeprefix("proteus_ci_") not in setting
    assert parse_keys(setting)["ci"].scopes == {"read", "write"}


@pytest.mark.parametrize(
    "setting",
    [
        "ci",
        "ci:abc:read",
        f"ci:{'0' * 64}",
        f"ci:{'0' * 64}:",
        f"ci:{'0' * 64}:root",
        f"ci_x:{'0' * 64}:read",
        f"ci:{'0' * 64}:read:more",
        f"ci:{'0' * 64}:read,ci:{'1' * 64}:read",
    ],
)
def test_keys_that_cannot_be_read_refuse_to_start(setting: str) -> None:
    with pytest.raises(SettingsError, match="PROTEUS_API_KEYS"):
        parse_keys(setting)


def test_a_rate_that_cannot_be_read_refuses_to_start(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    settings = make_settings(tmp_path_factory.mktemp("rates"), rate_limit="often")
    with pytest.raises(SettingsError, match="PROTEUS_RATE_LIMIT"):
        create_app(settings)


def test_who_asks_too_often_is_told_when_to_come_back(start: Start) -> None:
    made = [new_key(name, ["read"]) for name in ("a", "b")]
    api = start(api_keys=",".join(setting for _, setting in made), rate_limit="3/hour")
    first, second = ({"Authorization": f"Bearer {token}"} for token, _ in made)
    for _ in range(3):
        api.get("/v1/models", headers=first)
    answer = api.client.get("/v1/models", headers=first)
    assert answer.status_code == 429
    assert 3500 < int(answer.headers["Retry-After"]) <= 3600
    assert answer.json()["type"] == "/problems/too-many-requests"
    api.get("/v1/models", headers=second)
    for _ in range(5):
        api.get("/healthz")


def test_without_keys_rates_count_by_address(start: Start) -> None:
    api = start(rate_limit="2/hour")
    api.get("/v1/models")
    api.get("/v1/models")
    api.get("/v1/models", 429)
