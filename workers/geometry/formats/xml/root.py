"""The root element of XML, found at a glance."""

import re

LOOKED_AT = 1 << 13  # bytes
PROLOG = re.compile(rb"(?:\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE\s[^>\[]*>)*", re.DOTALL | re.I)
ROOT = re.compile(rb"<(?:[\w.-]+:)?([A-Za-z_][\w.-]*)")


def split_prolog(data: bytes) -> tuple[bytes, bytes]:
    """Cut the beginning of XML where its root element starts.

    Parameters
    ----------
    data : bytes
        The beginning of a file, in UTF-8.

    Returns
    -------
    tuple of bytes
        Declaration, comments and document type; then what follows.
    """
    head = data[:LOOKED_AT]
    found = PROLOG.match(head)
    end = found.end() if found else 0
    return head[:end], head[end:]


def xml_root(data: bytes) -> str:
    """Name of the root element.

    Parameters
    ----------
    data : bytes
        The beginning of a file, in UTF-8.

    Returns
    -------
    str
        In lower case and without its prefix; empty where the file is no XML.
    """
    if data[:LOOKED_AT].lstrip()[:1] != b"<":
        return ""
    root = ROOT.match(split_prolog(data)[1])
    return root[1].decode("ascii", "replace").lower() if root else ""
