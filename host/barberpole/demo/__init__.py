"""The whole job on the emulated board, from data-sheet values to a self-calibrated board that the host believes."""
