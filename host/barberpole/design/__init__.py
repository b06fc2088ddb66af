"""What is dimensioned before a board is built: flipping, amplifier, feedback, Helmholtz coil, shield."""
