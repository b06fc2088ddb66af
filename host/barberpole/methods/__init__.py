"""Published and closed-form methods, each with its equation numbers."""
