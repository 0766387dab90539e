"""The twin of the sparse-data problem: deformed livers of which only some of the surface is seen.

In the manner of the Image-to-Physical Liver Registration Sparse Data Challenge (Collins et al. 2017, IEEE Trans. Med.
Imaging 36:1502; Heiselman et al. 2024, J. Med. Imaging 11:015001), whose phantom and data these are not.
"""
