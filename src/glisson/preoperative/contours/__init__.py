"""Curves and surfaces that move through an image: localized active contours, snakes, splines."""
