"""One router a resource, thin: check, blob, rows, commit, dispatch, answer."""
