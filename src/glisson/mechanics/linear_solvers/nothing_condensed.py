"""The condensation of a body all of whose unknowns are kept, as that of a small one near its tools."""

from scipy.sparse import csr_matrix, triu

from glisson.core.arrays import FloatArray


class NothingCondensed:
    """A `Condensation` onto all unknowns."""

    def factor(self, upper: csr_matrix) -> FloatArray:
        """The matrix itself (n, n)."""
        whole: FloatArray = (upper + triu(upper, 1).T).toarray()
        return whole

    def reduce(self, right: FloatArray) -> FloatArray:
        """The right-hand side (n,)."""
        return right

    def expand(self, kept: FloatArray) -> FloatArray:
        """The unknowns (n,) themselves."""
        return kept

    def close(self) -> None:
        """Nothing is held."""
