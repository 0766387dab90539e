"""The label table of Caret and Connectome Workbench: XML that names the numbers of a label map."""

from collections.abc import Mapping
from colorsys import hsv_to_rgb
from xml.etree import ElementTree

from glisson.core import BadInput

_GOLDEN_RATIO = 0.618034


def caret_table(names: Mapping[int, str]) -> bytes:
    """The extension's bytes; colours are spread over the hues, since viewers want some."""
    root = ElementTree.Element("CaretExtension")
    information = ElementTree.SubElement(root, "VolumeInformation", Index="0")
    table = ElementTree.SubElement(information, "LabelTable")
    for number, name in names.items():
        label = ElementTree.SubElement(table, "Label", Key=str(number), Alpha="1")
        colour = hsv_to_rgb(number * _GOLDEN_RATIO % 1.0, 0.7, 0.9)
        for key, shade in zip(("Red", "Green", "Blue"), colour, strict=True):
            label.set(key, f"{shade:.3f}")
        label.text = name
    ElementTree.SubElement(information, "VolumeType").text = "Label"
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def names_from_caret(text: str) -> dict[int, str]:
    """Names by label number; number 0 (background) is left out.

    Raises:
        BadInput: the table is damaged.
    """
    cleaned = text.strip().strip("\0").strip()
    # A label table needs no document type; entities are how small XML becomes huge.
    if "<!DOCTYPE" in cleaned or "<!ENTITY" in cleaned:
        raise BadInput("its table of label names declares a document type, which is not read.")
    try:
        labels = ElementTree.fromstring(cleaned.encode()).iter("Label")
        names = {int(label.attrib["Key"]): (label.text or "").strip() for label in labels}
    except (ElementTree.ParseError, KeyError, ValueError) as error:
        raise BadInput(f"its table of label names is damaged ({error}).") from error
    return {number: name for number, name in names.items() if number != 0 and name}
