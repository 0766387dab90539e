"""Tissue mechanics: what a manoeuvre does to the organ (design, section 3)."""
