"""Text from outside as it may stand in a prompt."""

from rich.text import Text

from adaptbot_cli.core.visible import visible

_LONGEST, _LONGEST_NAME = 300, 70


def shown(text: str, style: str = "", longest: int = _LONGEST) -> Text:
    """Return text that is never markup nor an escape code, cut to a bearable length."""
    cut = Text(visible(text), style)
    cut.truncate(longest, overflow="ellipsis")
    return cut


def plain(text: str) -> str:
    """Return the same as a string, for prompts: they take no markup in strings."""
    return shown(text).plain


def title(name: str) -> str:
    """Return a name as it stands in a list: in words."""
    return shown(name.replace("_", " "), longest=_LONGEST_NAME).plain
