"""The verbs: ingest, describe, query, activate, evaluate."""
