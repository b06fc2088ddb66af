# bp_native.py: machine code (bp_fixed) where this MicroPython compiles it, the same in bytecode where it does not.
try:
    import bp_fixed as fixed
    from bp_fixed import add, crc16, sum16, sum24
except (ImportError, ValueError, SyntaxError, AttributeError, NameError):  # not there, or for another processor
    fixed = None

    def add(limbs, count):  # to a number of 64 bits in four halfwords; count: 0 to 2^30
        for i in range(4):
            count += limbs[i]
            limbs[i] = count & 0xFFFF
            count >>= 16

    def crc16(data, count):  # CCITT, polynomial 0x1021, start 0xFFFF, a byte at a time
        crc = 0xFFFF
        for i in range(count):
            x = crc >> 8 ^ data[i]
            x ^= x >> 4
            crc = (crc << 8 ^ x << 12 ^ x << 5 ^ x) & 0xFFFF
        return crc

    def sum24(
        raw, at, step, end, found
    ):  # found: sum, smallest and largest of the 24-bit words at `at`, `at` + step, ...
        total, low, high = 0, 0x7FFFFF, -0x800000
        while at < end:  # a range with a step from elsewhere would be an object on the heap
            word = raw[at] << 16 | raw[at + 1] << 8 | raw[at + 2]
            if word & 0x800000:
                word -= 0x1000000
            total += word
            if word < low:
                low = word
            if word > high:
                high = word
            at += step
        found[0], found[1], found[2] = total, low, high

    def sum16(codes, at, step, end, found):  # the same of codes without a sign
        total, low, high = 0, 0xFFFF, 0
        while at < end:
            word = codes[at]
            total += word
            if word < low:
                low = word
            if word > high:
                high = word
            at += step
        found[0], found[1], found[2] = total, low, high
