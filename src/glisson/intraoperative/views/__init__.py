"""Surface points from two or more laparoscope views and one touched point."""
