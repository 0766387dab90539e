"""How fast and how right the reduced model is, on a liver of public data."""
