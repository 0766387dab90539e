"""Single structures about a click: tumours, gallbladder, guide wire and stent."""
