"""Errors that people read: each carries one sentence saying what is wrong, where, and what to do."""

from glisson.core.status import Status


class GlissonError(Exception):
    """Base of every error Glisson raises on purpose; its text is a sentence for people."""

    exit_code = 1


class BadInput(GlissonError):
    """Something given to Glisson is unusable (file, parameter, scenario); the CLI exits with 2."""

    exit_code = 2


class StageFailed(GlissonError):
    """A stage ran and could not give a result; the CLI exits with 1.

    `status` says in which of the agreed ways it failed.
    """

    def __init__(self, sentence: str, status: Status) -> None:
        super().__init__(sentence)
        self.status = status
