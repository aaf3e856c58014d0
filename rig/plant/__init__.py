"""The virtual bench: pneumatics, specimen, sensors and camera scene in simulated time."""
