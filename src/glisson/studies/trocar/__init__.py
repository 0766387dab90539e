"""The study of trocar poses (dissertation, section 5.2)."""
