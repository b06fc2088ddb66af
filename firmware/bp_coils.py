# bp_coils.py: currents through the three offset coils, as codes of the converter that drives them.
# The middle of its codes is no current; the ends of the range are -full_scale and +full_scale of the board file.


class Coils:
    def __init__(self, dac, channels, full_scale_ma):  # three channels, three currents
        self._dac = dac
        self._zero = dac.zero
        self._channels = channels
        self._full_scale_ma = full_scale_ma
        self.zero()

    def set(self, codes):  # three codes, x y z
        for axis in range(3):
            self._dac.write(self._channels[axis], codes[axis])

    def zero(self):
        for axis in range(3):
            self._dac.write(self._channels[axis], self._zero)

    def current_ma(self, axis, code):
        return (code - self._zero) / self._zero * self._full_scale_ma[axis]
