# bp_scan.py: the on-chip converter scans its inputs at every beat of TIM2 and DMA carries the codes into a ring.
# ADC1 and DMA2 stream 0, channel 0 (RM0090 chapters 10 and 13). No interrupt is enabled: MicroPython's handler of a
# stream that it did not start clears no flag. MicroPython switches an idle DMA controller off 64 ms after its own last
# transfer on it, so the board file keeps its other users off DMA2, and `silent` looks.
# The ring lies on the heap, which is in SRAM; DMA does not reach the core-coupled memory.
import time
from array import array

import machine
import stm
import uctypes
from micropython import const
from stm import mem8, mem32

INPUTS = const(8)  # x y z bridge coil_x coil_y coil_z supply
_HALFWORDS = const(65535)  # most of one DMA transfer
_STREAM0 = const(0x10)  # in DMA2: CR NDTR PAR M0AR M1AR FCR
_NDTR = const(4)
_PAR = const(8)
_M0AR = const(12)
_FCR = const(20)
_EN = const(1)
_STREAM = const(3 << 16 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8)  # very high, 16 bits, MINC, CIRC; no interrupt
_FLAGS0 = const(0x3D)  # all of stream 0 in LISR and LIFCR
_DMA2_CLOCK = const(0x40)  # in the third byte of RCC_AHB1ENR
_ADC1_CLOCK = const(0x100)  # RCC_APB2ENR
_COMMON_CCR = const(0x304)  # of the ADCs, from ADC1
_QUARTER = const(1 << 16)  # ADCPRE: PCLK2 / 4, 21 MHz; the reset value / 2 would be 42 MHz, above the 36 MHz allowed
_SCAN = const(0x100)  # CR1
_ON = const(1)  # CR2.ADON
_DMA_ALWAYS = const(3 << 8)  # CR2.DMA and DDS
_ON_TIM2_CC2 = const(1 << 28 | 3 << 24)  # CR2.EXTEN = rising edge, EXTSEL
_OVR = const(0x20)  # SR
_SAMPLE_28 = const(0o2222222222)  # 28 clocks for each of ten inputs: 1.3 us
_CLOCKS = const(40)  # of one conversion: 28 and 12
_ADC_MHZ = const(21)
_POWER_UP_US = const(10)


class Scan:
    def __init__(self, pins, channels, halfwords):  # eight analogue pins and the ADC1 inputs that they are
        if halfwords > _HALFWORDS:
            raise ValueError(f"a ring of {halfwords} codes is too long for DMA")
        self.ring = array("H", bytearray(2 * halfwords))
        if uctypes.addressof(self.ring) >> 28 != 2:
            raise ValueError("the ring must lie in SRAM, where DMA reaches it")
        self._channels = channels
        self.used = halfwords  # codes of the ring that are in use
        self.scan_us = INPUTS * _CLOCKS // _ADC_MHZ + 1
        for name in pins:
            machine.Pin(name, machine.Pin.ANALOG)

    def start(self, used):  # waits for beats from here on
        self.stop()
        self.used = used
        mem8[stm.RCC + stm.RCC_AHB1ENR + 2] |= _DMA2_CLOCK
        mem32[stm.RCC + stm.RCC_APB2ENR] |= _ADC1_CLOCK
        self._start_dma()
        self._start_adc()

    def _start_dma(self):
        stream = stm.DMA2 + _STREAM0
        mem32[stm.DMA2 + stm.DMA_LIFCR] = _FLAGS0
        mem32[stream + _NDTR] = self.used
        mem32[stream + _PAR] = stm.ADC1 + stm.ADC_DR
        mem32[stream + _M0AR] = uctypes.addressof(self.ring)
        mem32[stream + _FCR] = 0
        mem32[stream] = _STREAM
        mem32[stream] = _STREAM | _EN

    def _start_adc(self):
        adc = stm.ADC1
        mem32[adc + _COMMON_CCR] = _QUARTER
        mem32[adc + stm.ADC_SMPR1] = _SAMPLE_28 & 0o777777777
        mem32[adc + stm.ADC_SMPR2] = _SAMPLE_28
        ch = self._channels
        mem32[adc + stm.ADC_SQR3] = ch[0] | ch[1] << 5 | ch[2] << 10 | ch[3] << 15 | ch[4] << 20 | ch[5] << 25
        mem32[adc + stm.ADC_SQR2] = ch[6] | ch[7] << 5
        mem32[adc + stm.ADC_SQR1] = INPUTS - 1 << 20
        mem32[adc + stm.ADC_CR1] = _SCAN
        mem32[adc + stm.ADC_CR2] = _ON
        time.sleep_us(_POWER_UP_US)
        mem32[adc + stm.ADC_SR] = 0
        mem32[adc + stm.ADC_CR2] = _ON | _DMA_ALWAYS | _ON_TIM2_CC2

    def position(self):  # scans written whole in this lap
        return (self.used - mem32[stm.DMA2 + _STREAM0 + _NDTR]) // INPUTS

    def silent(self):  # whether codes can no longer reach the ring: an overrun, or DMA without a clock
        return mem32[stm.ADC1 + stm.ADC_SR] & _OVR != 0 or not mem8[stm.RCC + stm.RCC_AHB1ENR + 2] & _DMA2_CLOCK

    def stop(self):
        mem32[stm.ADC1 + stm.ADC_CR2] = 0
        mem8[stm.RCC + stm.RCC_AHB1ENR + 2] |= _DMA2_CLOCK  # its registers can be written with a clock only
        mem32[stm.DMA2 + _STREAM0] = 0
        while mem32[stm.DMA2 + _STREAM0] & _EN:  # the transfer under way ends first
            pass
