# Prints a few SET and RESET averages.
import adc

adc.start()
for _ in range(3):
    for pin in (adc.set_pin, adc.reset_pin):
        adc.pulse(pin)
        print(" ".join("%.3f" % value for value in adc.mean()))
print("end of readings")
