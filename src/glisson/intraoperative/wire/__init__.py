"""The centreline of a guide wire or stent, as a curve along which material may slide."""
