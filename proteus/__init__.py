"""Proteus, a search engine for deformable 3D shapes: its Python client and its command line.

``Client`` talks HTTP to a service. Importing it loads neither numpy nor any part of the engine,
and changes nothing in the process.
"""

from proteus.client import Client, Document, ServiceError, UnreachableError
from proteus.jobs import JobWatch

__all__ = ["Client", "Document", "JobWatch", "ServiceError", "UnreachableError"]
