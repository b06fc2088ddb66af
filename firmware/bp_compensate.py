# bp_compensate.py: from the sums of a point to physical figures: field, temperature, currents, supply.
# The field is the factory calibration, undone by the generated bp_calibration, composed with today's coil result
# (thesis 6.7): `gain` enters where the scale does, after the bias is taken off; `offset_lsb` is the bridges' electronic
# offset beyond the model's; `shift_ut` is the change of the bias that only a shielded run can know, zero otherwise.
import bp_sampler as at


class Compensator:
    def __init__(self, board, calibration):
        self._board = board
        self._undo = calibration.undo
        self.gain = (1.0, 1.0, 1.0)
        self.offset_lsb = calibration.FACTORY_OFFSET_LSB
        self.shift_ut = (0.0, 0.0, 0.0)

    def put_in_force(self, stored):  # a bp_store.Stored
        self.gain = tuple(stored.gain)
        self.offset_lsb = tuple(stored.offset_lsb)
        self.shift_ut = tuple(stored.shift_ut)

    def field_ut(self, means, temp_c):  # means: six averages in LSB as `means_lsb` gives them
        after_set = [means[i] - self.offset_lsb[i] for i in range(3)]
        after_reset = [self.offset_lsb[i] - means[3 + i] for i in range(3)]
        x, y, z = self._undo(*after_set, *after_reset, temp_c, *self.gain)
        shift = self.shift_ut
        return x - shift[0], y - shift[1], z - shift[2]

    def temp_c(self, sampler):  # of the bridge, from its resistance at the constant current
        mean = sampler.sums[at.BRIDGE] / (2 * sampler.cycles)
        return self._board.TEMP_AT_0_C + self._board.TEMP_C_PER_LSB * mean

    def coil_ma(self, sampler):
        scale = self._board.COIL_MA_PER_LSB / (2 * sampler.cycles)
        return tuple(sampler.sums[at.COIL + axis] * scale for axis in range(3))

    def supply_v(self, sampler):
        return sampler.sums[at.SUPPLY] * self._board.SUPPLY_V_PER_LSB / (2 * sampler.cycles)


def means_lsb(sampler):  # SET x y z, RESET x y z, each with its own sign
    count = sampler.samples * sampler.cycles
    return tuple(sampler.sums[i] / count for i in range(6))
