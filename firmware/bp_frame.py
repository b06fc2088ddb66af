# bp_frame.py: a frame of fixed length, made in place: type, sequence, payload and check sum as one line of base64.
# With native code nothing is allocated. The length is a multiple of three, so the line has no padding.
import binascii

from bp_native import crc16, fixed

HEAD = 3  # bytes before the payload: type and sequence
_ALPHABET = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"


class Frame:
    def __init__(self, kind, size):  # size: of the payload, one more than a multiple of three
        self.body = bytearray(HEAD + size + 2)
        self.body[0] = kind
        self._text = bytearray(2 + 4 * len(self.body) // 3)
        self._text[0] = 36  # "$"
        self._text[-1] = 10

    def sealed(self, sequence):  # the line, good until the next call
        body = self.body
        size = len(body)
        body[1] = sequence & 0xFF
        body[2] = sequence >> 8
        crc = crc16(body, size - 2)
        body[size - 2] = crc & 0xFF
        body[size - 1] = crc >> 8
        if fixed is None:
            self._text[1:] = binascii.b2a_base64(bytes(body))
        else:
            fixed.base64(body, size, self._text, 1, _ALPHABET)
        return self._text


def of_json(kind, text):  # a frame that is said again and again; spaces after JSON mean nothing
    text += b" " * ((1 - len(text)) % 3)
    frame = Frame(kind, len(text))
    frame.body[HEAD : HEAD + len(text)] = text
    return frame
