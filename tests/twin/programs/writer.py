# Replaces a file again and again; every version is whole or absent.
import os
import time

number = 0
while True:
    number += 1
    with open("new", "w") as file:
        file.write(("%d " % number) * 300)
    os.rename("new", "kept")
    time.sleep_ms(1)
