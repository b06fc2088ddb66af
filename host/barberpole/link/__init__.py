"""The cable: flashing, recording and pulling through mpremote and pyserial."""
