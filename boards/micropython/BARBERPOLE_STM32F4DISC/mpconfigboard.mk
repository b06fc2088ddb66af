# Discovery F4 with barberpole in ROMFS: BOARD_DIR of MicroPython's stm32 port.
# With BOARD_VARIANT=FROZEN it is in the firmware itself.
include boards/STM32F4DISC/mpconfigboard.mk

# The stock linker scripts, and after them what this board says otherwise.
LD_FILES += $(BOARD_DIR)/romfs.ld

# The stock pins. The port assigns this, and the next one, after it has read this file: hence override.
override BOARD_PINS = boards/STM32F4DISC/pins.csv

# Native code of frozen modules may use the floating-point unit.
override MPY_CROSS_MCU_ARCH_f4 = armv7emsp
