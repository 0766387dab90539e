"""What a scan is looked at through: slice axis, working resolution, smoothing, connected parts, the scan's ends."""
