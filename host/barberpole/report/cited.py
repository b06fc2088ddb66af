"""Numbers on a page that say where they come from: the same object that --json prints, by JSON pointer (RFC 6901).

A cited number is `<data value="6.2718..." data-from="/logs/0/fit/rms_lsb">6.272</data>`, so whoever reads the page, a
test too, can find the number again in the object that the page carries.
"""

from collections.abc import Callable
from dataclasses import dataclass
from string import Formatter
from typing import Any

from markupsafe import Markup, escape

from barberpole.numbers import plain, signed


@dataclass(frozen=True)
class Answer:
    """A part of what --json prints, at `pointer` of the whole."""

    value: Any
    pointer: str = ""

    def at(self, *keys: str | int) -> "Answer":
        """A part of this part."""
        value, pointer = self.value, self.pointer
        for key in keys:
            value = value[key]
            pointer += "/" + str(key).replace("~", "~0").replace("/", "~1")
        return Answer(value, pointer)

    def number(self, *keys: str | int, form: Callable[[Any], str] = plain) -> Markup:
        """One number as the page shows it: a count with all its digits, others by `form`."""
        part = self.at(*keys)
        known = str if isinstance(part.value, int) else form
        text = "not known" if part.value is None else known(part.value)
        shown = "" if part.value is None else repr(part.value)
        return Markup('<data value="{}" data-from="{}">{}</data>').format(shown, part.pointer, text)

    def say(self, sentence: str) -> Markup:
        """A sentence with numbers in it: "{fit rms_lsb} LSB", keys parted by spaces, digits or % after a colon."""
        out = Markup("")
        for text, field, spec, _ in Formatter().parse(sentence):
            out += escape(text)
            if field is not None:
                keys = [int(key) if key.isdigit() else key for key in field.split()]
                out += self.number(*keys, form=_form(spec or ""))
        return out


def _form(spec: str) -> Callable[[Any], str]:
    """3: significant figures; +3: with the sign; %: a share as per cent; s: as it is."""
    if spec == "s":
        return str
    if spec.endswith("%"):
        return lambda value: plain(100 * value, int(spec[:-1] or 3))
    if spec.startswith("+"):
        return lambda value: signed(value, int(spec[1:] or 3))
    return lambda value: plain(value, int(spec or 4))
