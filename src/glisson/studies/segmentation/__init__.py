"""How well the liver is found in scans of the phantom family, and whether failures are flagged."""
