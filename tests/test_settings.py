"""Settings: known, sensible, documented; everything else refuses to start by name."""

from pathlib import Path

import pytest

from workers.settings import Settings, SettingsError, load_settings

DOCUMENT = (Path(__file__).parent.parent / "docs" / "settings.md").read_text()


@pytest.mark.parametrize("name", Settings.model_fields)
def test_every_setting_is_documented_as_it_is(name: str) -> None:
    field = Settings.model_fields[name]
    (row,) = [line for line in DOCUMENT.splitlines() if f"`PROTEUS_{name.upper()}` |" in line]
    assert str(field.description) in row
    if field.default_factory is None and field.default != "":
        assert f"`{field.default}`" in row


def test_nothing_is_documented_that_is_not_there() -> None:
    rows = [line for line in DOCUMENT.splitlines() if line.startswith("| `PROTEUS_")]
    assert len(rows) == len(Settings.model_fields)


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("PROTEUS_PORT", "seventy"),
        ("PROTEUS_DATABASE_URL", "mysql://localhost/x"),
        ("PROTEUS_BROKER_URL", "amqp://localhost"),
        ("PROTEUS_MAX_ATTEMPTS", "0"),
        ("PROTEUS_SHAPE_SECONDS", "0"),
        ("PROTEUS_SHAPE_SECONDS", "900"),
        ("PROTEUS_LOG_LEVEL", "loud"),
    ],
)
def test_a_value_that_makes_no_sense_is_named(
    monkeypatch: pytest.MonkeyPatch, variable: str, value: str
) -> None:
    monkeypatch.setenv(variable, value)
    with pytest.raises(SettingsError, match=variable):
        load_settings()


def test_a_mesh_has_less_time_than_a_task(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PROTEUS_TASK_SECONDS", "60")
    with pytest.raises(SettingsError, match=r"PROTEUS_SHAPE_SECONDS.*PROTEUS_TASK_SECONDS"):
        load_settings()
    monkeypatch.setenv("PROTEUS_SHAPE_SECONDS", "59.5")
    assert load_settings().shape_seconds == 59.5


def test_an_unknown_variable_refuses_to_start() -> None:
    with pytest.raises(SettingsError, match="PROTEUS_PROT"):
        load_settings({"PROTEUS_PROT": "8000"})
    load_settings({"PROTEUS_URL": "http://127.0.0.1:1", "PATH": "/bin"})


def test_urls_follow_the_data_directory_unless_set(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    assert settings.resolved_database_url == f"sqlite:///{tmp_path}/proteus.sqlite3"
    assert settings.resolved_blob_url == f"file://{tmp_path}/blobs"
    assert settings.resolved_broker_url.startswith("redis+socket:///")
    assert len(settings.resolved_broker_url) < 107
    postgres = Settings(database_url="postgresql://a@b/c")
    assert postgres.resolved_database_url == "postgresql+psycopg://a@b/c"
