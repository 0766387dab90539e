"""Whether the lever lift converges whatever the liver, the lever, the tissue and the contact."""
