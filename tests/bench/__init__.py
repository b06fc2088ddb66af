"""`make bench`: our time, error and memory beside plain linear least squares and the peers, on the same data."""
