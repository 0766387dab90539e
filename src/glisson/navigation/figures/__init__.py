"""The report's pictures, each a self-contained PNG with an alternative text and a caption."""
