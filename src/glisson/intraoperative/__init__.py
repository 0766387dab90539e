"""Intra-operative: what cameras, tools and wires tell during surgery, each with its covariance."""
