"""Checks for machines: plain values that JSON can hold (keys as in `glisson verify --json`)."""

from collections.abc import Iterable
from typing import Any

from glisson.verification.check import Check


def check_record(check: Check) -> dict[str, Any]:
    """A check as plain values; `reason` is null where there is a value."""
    return {
        "name": check.name,
        "value": check.value,
        "expected": check.expected,
        "tolerance": check.tolerance,
        "unit": check.unit,
        "passed": check.passed,
        "reason": check.reason or None,
        "source": check.source,
    }


def order_records(checks: Iterable[Check]) -> list[dict[str, Any]]:
    """Observed orders of convergence with the errors that they come from."""
    return [
        {
            "name": check.name,
            "order": check.value,
            "expected": check.expected,
            "sizes_mm": list(check.convergence.sizes),
            "errors": list(check.convergence.errors),
        }
        for check in checks
        if check.convergence is not None
    ]
