"""The documentation needs no network but the service."""

import re

from tests.service.running import Api


def test_the_documentation_is_made_of_what_the_service_serves(api: Api) -> None:
    page = api.client.get("/docs").text
    links = re.findall(r'(?:src|href)="([^"]+)"', page)
    local = [link for link in links if not link.startswith("data:")]
    assert len(local) == 2
    for link in local:
        assert link.startswith("/"), link
        assert api.client.get(link).status_code == 200
    assert "/openapi.json" in page
