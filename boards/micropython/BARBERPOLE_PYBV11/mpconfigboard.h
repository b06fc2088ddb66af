// Pyboard v1.1 as in stock MicroPython, with a ROMFS partition in the MCU's own flash; romfs.ld says where.
#include "boards/PYBV11/mpconfigboard.h"

#undef MICROPY_HW_BOARD_NAME
#define MICROPY_HW_BOARD_NAME "PYBv1.1 with barberpole"

// The variant FROZEN has no use for a partition and gives the flash to the firmware.
#ifndef BARBERPOLE_FROZEN
#define MICROPY_HW_ROMFS_ENABLE_INTERNAL_FLASH (1)
#define MICROPY_HW_ROMFS_ENABLE_PART0 (1)
#endif
