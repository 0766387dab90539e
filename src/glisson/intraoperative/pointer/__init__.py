"""The tip of an instrument as a pointer and a pen: points, strokes, distances, resection planes and surfaces."""
