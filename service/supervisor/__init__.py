"""One program out of several processes: broker, migration, worker and API under one parent."""
