// The oscillators are those of the stock board.
#include "boards/NUCLEO_F446RE/stm32f4xx_hal_conf.h"
