"""Hidden-effect games: logs of an independent truth, and what was hidden in them, sealed.

The truth (world, motion, noise, record) is exact physics with distortions written by hand and imports nothing of
barberpole; only the game around it does.
"""
