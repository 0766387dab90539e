"""Files in and out: images, labels, meshes, scenarios and results; every file is guarded before it is decoded."""
