"""The one exception a user's mistake raises, and how a message is printed."""


class InputError(ValueError):
    """What the user gave cannot be used: one sentence that names the place, the value and what was expected."""


def printable(text: str) -> str:
    """A text with all that a terminal does not print escaped, line ends and escape sequences among it."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
