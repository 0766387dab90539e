"""Tables 3 and 4 of the dissertation on the half-sphere box, by its construction and by the joint adjustment."""
