"""One router a resource. Endpoints are short: check, blob, rows, commit, dispatch, answer."""
