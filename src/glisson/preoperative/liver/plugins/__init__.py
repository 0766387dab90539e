"""Segmenters that run another program where it is installed. Nothing in Glisson needs one, none comes with it."""
