"""3-D pictures without a graphics card: rays cast on the CPU (Embree), shaded with numpy."""
