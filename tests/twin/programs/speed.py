# Reads conversions as fast as they come.
import adc

adc.start()
for _ in range(40000):
    while adc.ready.value():
        pass
    adc.cs.value(0)
    adc.spi.write_readinto(adc.null, adc.frame)
    adc.cs.value(1)
print("end of reading")
