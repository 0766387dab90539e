"""Videos of a liver that breathes, as a laparoscope sees it, with the truth of each frame."""
