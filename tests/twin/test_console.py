"""From the unix interpreter's output to a board's."""

from barberpole.twin.console import PROMPT, RAW_BANNER, Console


def running():
    return True


def waiting():
    return False


def test_line_ends_become_a_terminals_even_when_split():
    console = Console(raw=False)
    assert console.plain(b"a\nb\r", running) + console.plain(b"\nc\n", running) == b"a\r\nb\r\nc\r\n"


def test_raw_restart_hides_the_friendly_banner():
    console = Console(raw=True)
    assert console.output(b"MicroPython ...\n>>> ", waiting) == b""
    assert console.output(b"\r\nraw REPL; CTRL-B ", waiting) == b""
    assert console.output(b"to exit\r\n>", waiting) == RAW_BANNER + b">"
    assert console.raw


def test_banners_tell_the_mode():
    console = Console(raw=False)
    console.output(PROMPT, waiting)
    assert not console.raw
    assert console.at_prompt
    console.output(RAW_BANNER, waiting)
    assert console.raw
    console.output(b"\r\n>>", waiting)
    console.output(b"> ", waiting)
    assert not console.raw


def test_binary_passes_untouched_while_ctrl_c_is_off():
    console = Console(raw=False)
    assert console.output(b"\x18\n\x00\n", waiting) == b"\x18\n\x00\n"
    assert console.output(b"\n", waiting) == b"\n"
    assert console.output(b"\n", running) == b"\r\n"
