"""The HTTP door of Proteus: API, search index, command line and supervisor."""
