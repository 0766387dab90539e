"""What acts on the organ's nodes beside its elements, tools and dead loads."""

from typing import Any, Protocol

from glisson.core.arrays import FloatArray, IntArray


class Part(Protocol):
    """A capsule, an elastic attachment, a pressure, a wire: forces as functions of the node positions (n, 3) in mm."""

    def energy(self, positions: FloatArray) -> float:
        """Potential in µJ."""

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) on the nodes in mN, minus the gradient of the potential."""

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Groups of nodes (k, a) that the part couples, and each group's ∂²Π/∂x² (k, a, a, 3, 3) in mN/mm.

        `project` makes it positive semi-definite. Groups may change from call to call.
        """

    def renew(self, positions: FloatArray) -> None:
        """Let friction's limits follow the present pressure."""

    def accept(self, positions: FloatArray) -> None:
        """Remember what a converged load step leaves behind, as friction's slip."""

    def memory(self) -> Any:
        """What a rejected step must put back."""

    def recall(self, memory: Any) -> None:
        """Put back what `memory` returned."""


class Memoryless:
    """What parts share that are elastic: they remember nothing."""

    def renew(self, positions: FloatArray) -> None:
        """Nothing rubs."""

    def accept(self, positions: FloatArray) -> None:
        """Nothing is left behind."""

    def memory(self) -> None:
        """Nothing."""

    def recall(self, memory: None) -> None:
        """Nothing is put back."""
