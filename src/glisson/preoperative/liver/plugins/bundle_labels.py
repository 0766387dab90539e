"""What a MONAI bundle says of itself in configs/metadata.json: for which scans it is, and how its labels are called."""

import json
from pathlib import Path
from typing import Any

from glisson.core.errors import BadInput


def label_number(bundle: Path, label: str, modality: str) -> int:
    """Number of the label in the bundle's result.

    Args:
        bundle: the bundle's folder.
        label: its name in the bundle, whatever the case of its letters, or its number.
        modality: of the scan, "CT" or "MR".

    Raises:
        BadInput: the metadata cannot be read, are for another modality, or have no such label.
    """
    path = bundle / "configs" / "metadata.json"
    try:
        formats = json.loads(path.read_text(encoding="utf-8"))["network_data_format"]
        names = {int(number): str(name) for number, name in formats["outputs"]["pred"]["channel_def"].items()}
        meant = _modality(formats["inputs"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise BadInput(
            f"{path} does not say the bundle's labels (network_data_format, outputs, pred, channel_def)."
        ) from None
    if meant and not meant.upper().startswith(modality):
        raise BadInput(f"The bundle {bundle.name!r} is for {meant}, but the scan is {modality}.")
    known = ", ".join(f"{number} {name}" for number, name in sorted(names.items()) if number > 0)
    for number, name in names.items():
        if number > 0 and label.strip().lower() in (name.lower(), str(number)):
            return number
    raise BadInput(f"The bundle {bundle.name!r} has no label {label!r}; it has {known[:200] or 'none'}.")


def _modality(inputs: dict[str, Any]) -> str:
    """Of the one input that the network has, "" where it is not said."""
    return str(next(iter(inputs.values())).get("modality", "")) if len(inputs) == 1 else ""
