"""CalculiX, the other engine: decks for it and its results back. It need not be installed to import this."""
