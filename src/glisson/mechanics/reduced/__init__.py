"""A model of few unknowns that is built once from full solutions and then answers in milliseconds."""
