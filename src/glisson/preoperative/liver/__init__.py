"""The liver's mask: from a click, or from another tool's labels."""
