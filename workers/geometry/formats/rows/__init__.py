"""Rows of numbers in files, binary and text, read with numpy."""
