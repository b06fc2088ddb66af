"""Several sensors on one board (thesis 6.2): calibrated in one coil run, and what they say together."""
