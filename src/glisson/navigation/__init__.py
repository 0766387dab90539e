"""What the deformation means to the surgeon: tumours, resection planes, volumes, vessels, wire, report."""
