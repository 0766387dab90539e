"""Centrelines and trees of vessels and ducts."""
