"""Where a trocar is: its camera sees crosses of known place (dissertation, section 5.2)."""
