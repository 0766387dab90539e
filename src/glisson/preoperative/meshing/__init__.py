"""Closed surfaces and tetrahedra of masks."""
