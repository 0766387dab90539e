"""Digital livers with known answers: shape, interior, CT, and for the demo the deformed truth."""
