"""What the region of interest saves and what it costs, over the phantom family."""
