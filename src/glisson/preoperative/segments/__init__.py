"""Couinaud's segments and the resections that are made of them."""
