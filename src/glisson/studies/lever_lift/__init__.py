"""How well the adjusted manoeuvre tells where tumour, plane and surface are after a lever lift."""
