"""Which lines the tests run: host and generator in CPython, firmware in MicroPython (`make lines`)."""
