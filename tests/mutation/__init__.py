"""What the tests would not notice: small faults put into the code one at a time (`make mutation`)."""
