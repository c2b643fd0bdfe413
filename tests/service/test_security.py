"""Keys, scopes and rates: who may do what, and how often."""

from pathlib import Path

import pytest

from service.app import create_app
from service.errors import RefusedError
from service.security import Gate, new_key, parse_keys
from tests.service.conftest import Start
from tests.service.running import Api, make_settings
from workers.settings import Settings, SettingsError

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
    **{("GET", f"{base}/correspondence"): "read" for base in (SHAPE, QUERY)},
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
    ("GET", "/v1/prune"): "admin",
    ("POST", "/v1/prune"): "admin",
}
ALLOWED = {"read": {"read"}, "write": {"read", "write"}, "admin": {"read", "write", "admin"}}


@pytest.fixture
def keys(start: Start) -> tuple[Api, dict[str, str]]:
    """A service with a key of each scope, and the tokens."""
    made = {scope: new_key(f"{scope}-1", [scope]) for scope in ALLOWED}
    api = start(api_keys=", ".join(setting for _, setting in made.values()))
    return api, {scope: token for scope, (token, _) in made.items()}


def bearer(token: str | None) -> dict[str, str]:
    return {} if token is None else {"Authorization": f"Bearer {token}"}


def test_every_operation_asks_for_its_scope(keys: tuple[Api, dict[str, str]]) -> None:
    api, tokens = keys
    for (method, path), scope in NEEDED.items():
        assert api.client.request(method, path).status_code == 401
        for held, token in tokens.items():
            headers = {"Authorization": f"Bearer {token}"}
            status = api.client.request(method, path, headers=headers).status_code
            assert (status == 403) == (scope not in ALLOWED[held]), (method, path, held, status)
            assert status != 401


def test_no_operation_was_forgotten(keys: tuple[Api, dict[str, str]]) -> None:
    document = keys[0].get("/openapi.json")
    assert set(document["components"]["securitySchemes"]) == {"key"}
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


@pytest.mark.parametrize("name", ["rate_limit", "key_attempts"])
def test_a_rate_that_cannot_be_read_refuses_to_start(name: str, tmp_path: Path) -> None:
    settings = make_settings(tmp_path, **{name: "often"})
    with pytest.raises(SettingsError, match=f"PROTEUS_{name.upper()}"):
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


def test_requests_with_a_bad_key_are_counted_too(start: Start) -> None:
    token, setting = new_key("a", ["read"])
    api = start(api_keys=setting, rate_limit="3/hour")
    for given in (None, f"{token}x", "nonsense"):
        api.get("/v1/models", 401, headers=bearer(given))
    answer = api.client.get("/v1/models", headers=bearer(f"{token}y"))
    assert (answer.status_code, answer.json()["type"]) == (429, "/problems/too-many-requests")
    assert 3500 < int(answer.headers["Retry-After"]) <= 3600
    api.get("/v1/models", headers=bearer(token))  # who has a key is counted by it


def test_a_secret_is_not_looked_at_once_too_many_were_tried(start: Start) -> None:
    made = {name: new_key(name, ["read"]) for name in ("a", "b")}
    api = start(api_keys=",".join(setting for _, setting in made.values()), key_attempts="3/hour")
    right = made["a"][0]
    for number in range(3):
        api.get("/v1/models", headers=bearer(right))
        api.get("/v1/models", 401, headers=bearer(f"{right}{number}"))
    answer = api.client.get("/v1/models", headers=bearer(right))
    assert answer.status_code == 429  # else the answer would tell that the guess was right
    assert 3500 < int(answer.headers["Retry-After"]) <= 3600
    assert "wrong keys" in answer.json()["detail"]
    api.get("/v1/models", headers=bearer(made["b"][0]))  # one client's slip shuts out no other key
    for _ in range(5):
        api.get("/v1/models", 401)  # no key at all is no guess


def test_by_default_wrong_keys_have_a_limit(start: Start) -> None:
    token, setting = new_key("a", ["read"])
    api = start(api_keys=setting)
    statuses = [
        api.client.get("/v1/models", headers=bearer(f"{token}{number}")).status_code
        for number in range(101)
    ]
    assert statuses == [401] * 100 + [429]


def test_attempts_are_the_addresss_own_and_a_network_of_ipv6_is_one() -> None:
    token, setting = new_key("a", ["read"])
    gate = Gate(Settings(api_keys=setting, key_attempts="1/hour"))

    def status(address: str, given: str = f"{token}x") -> int:
        try:
            gate.admit(given, "read", address=address)
        except RefusedError as error:
            return error.status
        return 200

    assert [status("192.0.2.1"), status("192.0.2.1", token)] == [401, 429]
    assert [status("192.0.2.2", token), status("::ffff:192.0.2.1")] == [200, 429]
    assert [status("2001:db8::1"), status("2001:db8::ffff"), status("2001:db8:0:1::1")] == [
        *(401, 429, 401)
    ]
    assert [status("a name"), status("a name"), status("another")] == [401, 429, 401]


def test_without_keys_rates_count_by_address(start: Start) -> None:
    api = start(rate_limit="2/hour")
    api.get("/v1/models")
    api.get("/v1/models")
    api.get("/v1/models", 429)
