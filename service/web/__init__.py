"""The page at ``/``: TypeScript in ``src``, built into ``dist`` by ``python -m service.web``."""
