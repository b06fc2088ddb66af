"""What bad data do to every method, to the fit and to the diagnosis: the table in host/docs/limits.md."""
