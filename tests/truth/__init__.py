"""Hidden-effect trials of the diagnosis, on the independent truth of barberpole.challenge."""
