"""A microcontroller seen from its registers: what the firmware's set-up code writes, and what the hardware makes of it.

`Mcu` takes reads and writes of TIM2, TIM8, ADC1, DMA2, GPIO, DAC and RCC as RM0090 describes them, on its own clock of
1/168 µs, and keeps the waveforms of the two flip outputs. `modules.load` imports firmware that talks to it.
"""

from registers.mcu import UNITS_PER_US, Mcu
from registers.modules import importable, load

__all__ = ["UNITS_PER_US", "Mcu", "importable", "load"]
