"""The one exception a user's mistake raises."""


class InputError(ValueError):
    """What the user gave cannot be used: one sentence that names the place, the value and what was expected."""
