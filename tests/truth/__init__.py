"""An independent truth: exact physics and distortions written by hand, sharing no code with barberpole.effects."""
