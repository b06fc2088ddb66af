# bp_native.py: machine code (bp_fixed) where this MicroPython compiles it, the same in bytecode where it does not.
try:
    import bp_fixed as fixed
    from bp_fixed import add, crc16
except (ImportError, SyntaxError, ValueError):  # the module is not there, or this port has no native code
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
