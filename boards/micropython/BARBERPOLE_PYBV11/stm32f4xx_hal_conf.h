// The oscillators are those of the stock board.
#include "boards/PYBV11/stm32f4xx_hal_conf.h"
