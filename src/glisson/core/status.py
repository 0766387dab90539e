"""How a computation ended. Every member reads as a sentence; only `CONVERGED` is a result."""

from enum import StrEnum


class Status(StrEnum):
    """Outcome of a solve, a pose estimate or a registration (design, sections 3 and 5)."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration_limit"
    INVERTED = "inverted"
    SINGULAR = "singular"
    STAGNATED = "stagnated"
    AMBIGUOUS = "ambiguous"
    UNOBSERVABLE = "unobservable"
    BAD_INPUT = "bad_input"

    @property
    def sentence(self) -> str:
        """The status as a sentence for people."""
        return _SENTENCES[self]

    @property
    def is_good(self) -> bool:
        """Whether the numbers that come with this status may be used."""
        return self is Status.CONVERGED


_SENTENCES = {
    Status.CONVERGED: "The computation converged.",
    Status.ITERATION_LIMIT: "The solver used all its iterations without reaching equilibrium.",
    Status.INVERTED: "An element turned inside out and no smaller step avoided it.",
    Status.SINGULAR: "Nothing holds the body against at least one free motion.",
    Status.STAGNATED: "The solver could not reduce the residual any further.",
    Status.AMBIGUOUS: "Two different answers explain the observations equally well.",
    Status.UNOBSERVABLE: "The observations do not determine the answer.",
    Status.BAD_INPUT: "The input cannot be used.",
}
