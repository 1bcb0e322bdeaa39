"""How many examples of a property are tried: few and the same by default, many in a long series."""

from hypothesis import settings

LONG = 20


def examples(number: int) -> settings:
    """Try so many examples, and many more in the long series (`--hypothesis-profile=long`)."""
    long = settings.get_current_profile_name() == "long"
    return settings(max_examples=number * LONG if long else number)
