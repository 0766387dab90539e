"""What the lungs do to markers on the liver, and how that is taken away again."""
