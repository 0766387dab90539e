"""What metal and gas do to a CT: found, lessened, and told (dissertation, section 6.1.3)."""
