"""The colours of printed markers: of crosses in the room, and of the wheels of instruments."""

MARKER_COLOURS = ("red", "yellow", "green", "blue")
"""Far apart in hue under any lamp, and each dark in one channel at least, where the paper is bright."""
