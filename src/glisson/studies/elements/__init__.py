"""Which element gives the smallest error of a target's place in the same time."""
