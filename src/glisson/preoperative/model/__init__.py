"""The organ's model: regions, attachments, and what is embedded in it."""
