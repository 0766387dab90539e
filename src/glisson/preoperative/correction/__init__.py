"""What a person corrects, carried on to the slices between, with undo."""
