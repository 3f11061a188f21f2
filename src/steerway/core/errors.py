"""The exception for wrong input, and the escaping of messages for terminals."""


class InputError(ValueError):
    """Wrong input. The message is one sentence that names the place, the value and what was expected."""


def printable(text: str) -> str:
    """A text with its unprintable characters escaped, line ends and terminal sequences included."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
