"""Instruments seen by a trocar's camera: which one it is, where its tip is, and when it was in use."""
