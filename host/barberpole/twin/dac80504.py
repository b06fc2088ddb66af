"""The DAC80504 at its pins: four 16-bit outputs, frames of 24 bits (datasheet SBAS871C, sections 8.5 and 8.6).

The version that wakes at half scale (M). Modelled: identity, gains, reference divider, broadcast, synchronous updates
with LDAC, soft reset, read back in the following frame. Not modelled: checksums, power down, alarms.
"""

from collections.abc import Callable

CHANNELS = 4
FRAME_BYTES = 3
MID_CODE = 0x8000
NOP, DEVICE_ID, SYNC, CONFIG, GAIN, TRIGGER, BROADCAST, STATUS, DAC0 = range(9)
IDENTITY = 0x0497  # 16 bits, four channels, half scale at reset
READ = 0x80
SOFT_RESET = 0b1010
LDAC = 0x10


class Dac80504:
    """One converter; `on_output(t_us, channel, volts)` is told of every output that changes."""

    def __init__(self, vref_v: float, gain_pin: bool, on_output: Callable[[float, int, float], None]):
        self._vref_v = vref_v
        self._gain_at_reset = 0x000F if gain_pin else 0
        self._on_output = on_output
        self._in = bytearray()
        self._answer = bytes(FRAME_BYTES)
        self._volts = [0.0] * CHANNELS
        self._reset(0.0)

    def select(self) -> None:
        """Chip select goes low."""
        self._in.clear()

    def exchange(self, t_us: float, data: bytes) -> bytes:
        """Clock `data` in and as many bytes out."""
        at = len(self._in)
        self._in += data
        return self._answer[at : at + len(data)].ljust(len(data), b"\0")

    def deselect(self, t_us: float) -> bool:
        """Chip select goes high: obey the frame, if it was complete. True: the caller's clock is not concerned."""
        if len(self._in) < FRAME_BYTES:
            return False
        address, value = self._in[0], self._in[1] << 8 | self._in[2]
        if address & READ:
            register = self._registers.get(address & 0x0F, 0)
            self._answer = bytes((address, register >> 8, register & 0xFF))
        else:
            self._answer = bytes(self._in[:FRAME_BYTES])
            self._write(t_us, address & 0x0F, value)
        return False

    def _write(self, t_us: float, address: int, value: int) -> None:
        if address == TRIGGER:
            if value & 0x0F == SOFT_RESET:
                self._reset(t_us)
            elif value & LDAC:
                self._load(t_us, [self._registers[DAC0 + i] for i in range(CHANNELS)])
        elif address == BROADCAST:
            self._write_channels(t_us, [i for i in range(CHANNELS) if self._registers[SYNC] >> 8 + i & 1], value)
        elif address >= DAC0:
            self._write_channels(t_us, [address - DAC0] if address < DAC0 + CHANNELS else [], value)
        elif address not in (NOP, DEVICE_ID, STATUS):
            self._registers[address] = value
            self._load(t_us, self._codes)

    def _write_channels(self, t_us: float, channels: list[int], value: int) -> None:
        codes = list(self._codes)
        for channel in channels:
            self._registers[DAC0 + channel] = value
            if not self._registers[SYNC] >> channel & 1:
                codes[channel] = value
        self._load(t_us, codes)

    def _reset(self, t_us: float) -> None:
        self._registers = {DEVICE_ID: IDENTITY, SYNC: 0xFF00, CONFIG: 0, GAIN: self._gain_at_reset}
        self._registers |= {DAC0 + i: MID_CODE for i in range(CHANNELS)}
        self._load(t_us, [MID_CODE] * CHANNELS)

    def _load(self, t_us: float, codes: list[int]) -> None:
        """Bring codes to the outputs."""
        self._codes = codes
        divided = 0.5 if self._registers[GAIN] & 0x100 else 1.0
        for channel, code in enumerate(codes):
            gain = 2.0 if self._registers[GAIN] >> channel & 1 else 1.0
            volts = self._vref_v * divided * gain * code / 0x10000
            if volts != self._volts[channel]:
                self._volts[channel] = volts
                self._on_output(t_us, channel, volts)
