"""Studies: many independent points, each done once, kept and counted."""
