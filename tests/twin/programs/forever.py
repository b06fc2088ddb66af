# Says a row every 5 ms of board time, as a streaming board does.
import time

row = 0
while True:
    time.sleep_ms(5)
    row += 1
    print("row", row)
