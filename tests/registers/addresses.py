"""Addresses and offsets (RM0090, memory map and register maps), as MicroPython's module `stm` names them."""

TIM1, TIM2, TIM4, TIM8 = 0x4001_0000, 0x4000_0000, 0x4000_0800, 0x4001_0400
ADC1, DAC, DMA1, DMA2, RCC = 0x4001_2000, 0x4000_7400, 0x4002_6000, 0x4002_6400, 0x4002_3800
GPIO = 0x4002_0000
GPIO_PORTS = {letter: GPIO + 0x400 * number for number, letter in enumerate("ABCDE")}
COMMON_CCR = ADC1 + 0x304
STREAM0 = DMA2 + 0x10
TIM_REGISTERS = (
    "CR1",
    "CR2",
    "SMCR",
    "DIER",
    "SR",
    "EGR",
    "CCMR1",
    "CCMR2",
    "CCER",
    "CNT",
    "PSC",
    "ARR",
    "RCR",
    "CCR1",
    "CCR2",
    "CCR3",
    "CCR4",
    "BDTR",
    "DCR",
    "DMAR",
)
TIM = {name: 4 * number for number, name in enumerate(TIM_REGISTERS)}
ADC = {"SR": 0, "CR1": 4, "CR2": 8, "SMPR1": 12, "SMPR2": 16, "SQR1": 44, "SQR2": 48, "SQR3": 52, "DR": 76}
STREAM = {"CR": 0, "NDTR": 4, "PAR": 8, "M0AR": 12, "FCR": 20}
RCC_AHB1ENR, RCC_APB1ENR, RCC_APB2ENR = 48, 64, 68
DAC_CR, DAC_DHR12R1, DAC_DHR12R2 = 0, 8, 20


def stm_names() -> dict[str, int]:
    """Names of the module `stm`."""
    names = {"TIM1": TIM1, "TIM2": TIM2, "TIM4": TIM4, "TIM8": TIM8, "ADC1": ADC1, "DAC": DAC, "RCC": RCC}
    names |= {"DMA1": DMA1, "DMA2": DMA2, "DMA_LISR": 0, "DMA_LIFCR": 8}
    names |= {f"TIM_{name}": offset for name, offset in TIM.items()}
    names |= {f"ADC_{name}": offset for name, offset in ADC.items()}
    names |= {"RCC_AHB1ENR": RCC_AHB1ENR, "RCC_APB1ENR": RCC_APB1ENR, "RCC_APB2ENR": RCC_APB2ENR}
    names |= {"DAC_CR": DAC_CR, "DAC_DHR12R1": DAC_DHR12R1, "DAC_DHR12R2": DAC_DHR12R2}
    return names
