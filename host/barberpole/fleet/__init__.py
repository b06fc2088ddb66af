"""Many boards: each log fitted, verified or diagnosed by itself, then what the boards tell together."""
