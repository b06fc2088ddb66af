"""What one sensor is worth: response, noise, drift with temperature, angles and outliers (article 2.4, 3; table 1)."""
