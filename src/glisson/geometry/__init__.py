"""What several components need of geometry: location, mapping, distance, cutting, planes (mm, LPS)."""
