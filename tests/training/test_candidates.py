"""Which channels a bank is chosen from."""

from workers.geometry.views import named_view
from workers.training.candidates import candidate_model


def names(*views: str) -> list[str]:
    """Names of the candidates under these views."""
    model = candidate_model([named_view(view) for view in views], power=0.25)
    return [channel.name for channel in model.channels]


def test_many_eigenpairs_allow_for_finer_kernels() -> None:
    closed, detailed = names("closed"), names("detailed")
    finer = set(detailed) - {name.replace("closed", "detailed") for name in closed}
    assert finer == {
        "detailed: heat 0.00025 even",
        "detailed: heat 0.00025",
        "detailed: hat 0.00025 even",
        "detailed: wave 7.4 even",
        "detailed: wave 7.4",
    }
    assert len(detailed) == len(closed) + len(finer)


def test_every_view_has_its_own_but_the_area_is_told_once() -> None:
    both = names("detailed", "smooth")
    assert len(set(both)) == len(both)
    assert [name for name in both if name.endswith("area")] == ["detailed: area"]
    assert {name.split(":")[0] for name in both} == {"detailed", "smooth"}
