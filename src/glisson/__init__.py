"""Glisson: computational image-based guidance for precision laparoscopy (research software)."""

from importlib.metadata import version

__version__ = version("glisson")
