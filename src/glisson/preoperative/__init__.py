"""From the scan to a patient's model: segmentation, surface, tetrahedra, structures, attachments."""
