"""``python -m benchmarks``: what needs no running service, measured beside peers."""

from benchmarks.spectrum import main

main()
