"""Markers on tissue followed through a video."""
