"""CalculiX's results: nodal fields of an ASCII `.frd` file, and running `ccx` itself where it is installed."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput

_NUMBER, _VALUE = 10, 12
"""Widths in characters of a node number and of a value (format I10, E12.5 of the .frd)."""


@dataclass(frozen=True, eq=False)
class NodalField:
    """One field at one time: name (for example "DISP"), step time, node numbers from 0, values (n, k)."""

    name: str
    time: float
    nodes: IntArray
    values: FloatArray


def calculix_program() -> str | None:
    """Where CalculiX is, or None."""
    return shutil.which("ccx")


def run_calculix(deck: Path, threads: int = 1) -> bool:
    """Run CalculiX on `deck` (name.inp) in its folder; output goes to name.log. Whether it ended well.

    Raises:
        BadInput: CalculiX is not installed.
    """
    program = calculix_program()
    if program is None:
        raise BadInput("CalculiX (ccx) is not installed; on Debian or Ubuntu: apt install calculix-ccx.")
    with deck.with_suffix(".log").open("wb") as log:
        done = subprocess.run(
            [program, "-i", deck.stem],
            cwd=deck.parent,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**os.environ, "OMP_NUM_THREADS": str(threads)},
            check=False,
        )
    return done.returncode == 0 and "Job finished" in deck.with_suffix(".log").read_text(errors="replace")


def read_frd(path: Path, name: str = "DISP") -> list[NodalField]:
    """All fields of one name in an ASCII .frd file, in order of time.

    Raises:
        BadInput: the file has no such field.
    """
    with path.open(errors="replace") as file:
        fields = [field for field in _fields(file) if field.name == name]
    if not fields:
        raise BadInput(f"{path.name} has no field {name}; ask for it in the deck's node file.")
    return fields


def _fields(lines: Iterator[str]) -> Iterator[NodalField]:
    time, name, components = 0.0, "", 0
    numbers: list[int] = []
    rows: list[list[float]] = []
    for line in lines:
        if line.startswith("  100C"):
            time = float(line[12:24])
        elif line.startswith(" -4"):
            name, components = line[5:13].strip(), 0
            numbers, rows = [], []
        elif line.startswith(" -5"):
            # The norm (ALL) is named among the components but not stored.
            components += not line.split()[-1].startswith("1ALL")
        elif line.startswith(" -1") and name:
            numbers.append(int(line[3 : 3 + _NUMBER]) - 1)
            rows.append(_values(line, components))
        elif line.startswith(" -3") and name:
            yield NodalField(name, time, np.array(numbers), np.array(rows))
            name = ""


def _values(line: str, count: int) -> list[float]:
    start = 3 + _NUMBER
    return [float(line[start + k * _VALUE : start + (k + 1) * _VALUE]) for k in range(count)]
