"""What the magnetometer is calibrated for: heading, velocity from the gradient, and the field expected at a place."""
