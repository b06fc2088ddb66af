// The oscillators are those of the stock board.
#include "boards/STM32F4DISC/stm32f4xx_hal_conf.h"
