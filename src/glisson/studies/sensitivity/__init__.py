"""How much the tumour's place depends on mesh, law, stiffness, compressibility and contact (section 4.4)."""
