"""Packed parts of files, unpacked within limits."""
