"""The command `glisson`: one file for each command, no numerics."""
