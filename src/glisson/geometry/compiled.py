"""Numba compilation that keeps a function's type for the type checker."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile `function` to machine code at its first call; the code is kept on disk for later runs."""
    return cast(_Function, numba.njit(cache=True)(function))
