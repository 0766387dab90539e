"""How well registrations find the liver: the twin of the sparse-data problem, its scores and its tables."""
