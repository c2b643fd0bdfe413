"""Triangles of what files hold: polygons are cut, and volumes have a boundary."""
