"""What breathing and ventilation do to markers, from videos with exact truth."""
