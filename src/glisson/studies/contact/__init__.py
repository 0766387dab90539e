"""The same lifts with our contact and with the IPC Toolkit's, which has another law, surface and way to the end."""
