# bp_fixed.py: the hot path in machine code: sums, fixed-point arithmetic, float32, check sum, base64. None allocates.
# A build holds it for the Cortex-M4; for another processor it is compiled anew; bp_native does without it if need be.
# A value v is n 2^(k-30) with |n| < 2^30; the generator has proved that no result leaves that (bp_hot). The same comes
# out with words of 32 and of 64 bits: a register is read as its lower 31 bits with sign, `(n & mask ^ sign) - sign`,
# and no number in here exceeds the small integers of a 32-bit MicroPython.
# pyright: reportUndefinedVariable=false, reportAttributeAccessIssue=false
import micropython


@micropython.viper
def take(sums: ptr32, offsets: ptr32, shifts: ptr16, inputs: ptr16, limits: ptr32, r: ptr32) -> int:
    # A cycle's 11 sums into the input registers; of the first six, offsets are taken off and the last three turned over
    # (RESET reads with the other sign). limits: 11 low, 11 high. Returns how many lie outside.
    one = 1
    sign = one << 30
    mask = sign + sign - 1
    outside = i = 0
    while i < 11:
        n = ((sums[i] & mask ^ sign) - sign) << shifts[i]
        if i < 6:
            n -= (offsets[i] & mask ^ sign) - sign
            if i > 2:
                n = -n
        if n < (limits[i] & mask ^ sign) - sign or n > (limits[i + 11] & mask ^ sign) - sign:
            outside += 1
        r[inputs[i]] = n
        i += 1
    return outside


@micropython.viper
def run(code: ptr16, count: int, r: ptr32):
    # 0: (a b) >> (30 - left); 1, 2: ((a >> right) +- (b >> right)) << left. The product of two 30-bit numbers is made
    # of four of 15 bits: high, middle twice, low, of which only the carry is kept.
    one = 1
    sign = one << 30
    mask = sign + sign - 1
    at = 0
    end = count << 2
    while at < end:
        word = code[at]
        left = word >> 12
        a = (r[code[at + 2]] & mask ^ sign) - sign
        b = (r[code[at + 3]] & mask ^ sign) - sign
        if word & 3:
            b = b >> (word >> 7 & 31)
            if word & 3 == 2:
                b = -b
            n = (a >> (word >> 2 & 31)) + b << left
        else:
            high_a = a >> 15
            high_b = b >> 15
            a = a & 0x7FFF
            b = b & 0x7FFF
            n = (high_a * high_b << left) + (high_a * b + a * high_b + (a * b >> 15) >> 15 - left)
        r[code[at + 1]] = n
        at += 4


@micropython.viper
def floats(r: ptr32, outputs: ptr16, exponents: ptr16, count: int, into: ptr8, at: int):
    # Registers as float32, rounded to nearest; exponents: of a register whose bit 29 is its first.
    one = 1
    sign = one << 30
    mask = sign + sign - 1
    i = 0
    while i < count:
        n = (r[outputs[i]] & mask ^ sign) - sign
        exponent = exponents[i]
        top = 0
        if n < 0:
            n = -n
            top = 128
        bits = 0
        if n:
            while n >> 29 == 0:
                n <<= 1
                exponent -= 1
            bits = (exponent - 1 << 23) + (n >> 6) + (n >> 5 & 1)
        into[at] = bits
        into[at + 1] = bits >> 8
        into[at + 2] = bits >> 16
        into[at + 3] = bits >> 24 | top
        at += 4
        i += 1


@micropython.viper
def copy(source: ptr8, count: int, into: ptr8, at: int):
    i = 0
    while i < count:
        into[at + i] = source[i]
        i += 1


@micropython.viper
def add(limbs: ptr16, count: int):  # to a number of 64 bits in four halfwords; count: 0 to 2^30
    i = 0
    while i < 4:
        count += limbs[i]
        limbs[i] = count
        count >>= 16
        i += 1


@micropython.viper
def crc16(data: ptr8, count: int) -> int:  # CCITT, polynomial 0x1021, start 0xFFFF, a byte at a time
    crc = 0xFFFF
    i = 0
    while i < count:
        x = crc >> 8 ^ data[i]
        x ^= x >> 4
        crc = (crc << 8 ^ x << 12 ^ x << 5 ^ x) & 0xFFFF
        i += 1
    return crc


@micropython.viper
def base64(data: ptr8, count: int, into: ptr8, at: int, alphabet: ptr8) -> int:  # count: of three; where it ends
    i = 0
    while i < count:
        word = data[i] << 16 | data[i + 1] << 8 | data[i + 2]
        into[at] = alphabet[word >> 18]
        into[at + 1] = alphabet[word >> 12 & 63]
        into[at + 2] = alphabet[word >> 6 & 63]
        into[at + 3] = alphabet[word & 63]
        at += 4
        i += 3
    return at


@micropython.viper
def sum24(raw: ptr8, at: int, step: int, end: int, found: ptr32):
    # found: sum, smallest and largest of the 24-bit words at `at`, `at` + step, ... below `end`
    total = 0
    low = 0x7FFFFF
    high = -0x800000
    while at < end:
        word = ((raw[at] ^ 0x80) - 0x80 << 16) + (raw[at + 1] << 8 | raw[at + 2])
        total += word
        if word < low:
            low = word
        if word > high:
            high = word
        at += step
    found[0] = total
    found[1] = low
    found[2] = high


@micropython.viper
def sum16(codes: ptr16, at: int, step: int, end: int, found: ptr32):
    # the same of codes without a sign
    total = 0
    low = 0xFFFF
    high = 0
    while at < end:
        word = codes[at]
        total += word
        if word < low:
            low = word
        if word > high:
            high = word
        at += step
    found[0] = total
    found[1] = low
    found[2] = high
