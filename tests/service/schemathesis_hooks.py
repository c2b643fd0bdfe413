"""What Schemathesis has to know beside the document: how texts of our own formats are made."""

import schemathesis
from hypothesis import strategies as st

from workers.storage.paging import encode_cursor

keys = st.text(st.characters(min_codepoint=1, codec="utf-8"), min_size=1, max_size=40)
schemathesis.openapi.format("cursor", keys.map(encode_cursor))
