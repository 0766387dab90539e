"""Calibrated cameras: projection, and what calibrates them."""
