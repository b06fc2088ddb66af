"""The commands by group. Each parses, calls and prints; nothing is computed here."""
