"""Damaged files through the command line: no traceback, no hang, no memory that a small file does not deserve."""
