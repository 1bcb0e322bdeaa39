"""Text from outside made safe to show: no character that a terminal would act on or hide."""

import unicodedata

_JOINERS = "\u200c\u200d"  # scripts and emoji are joined with them; alone they are harmless
_PICTURES = 0x2400  # the pictures of the control characters stand in their order from here
_NO_PICTURE = "\ufffd"


def visible(text: str) -> str:
    """Return the text on one line, with every character that controls instead of showing replaced.

    Line breaks, tabs and odd spaces become a space, the C0 controls and DEL their pictures
    (ESC is ␛), the rest a replacement character: C1 controls, marks that turn the direction of
    writing or cannot be seen, lone surrogates.
    """
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else _shown(char) for char in text)


def _shown(char: str) -> str:
    if char in _JOINERS:
        return char
    if char in "\t\n\r" or (char.isspace() and char > "\x7f"):
        return " "
    if char < " ":
        return chr(_PICTURES + ord(char))
    if char == "\x7f":
        return "\u2421"
    # A font may know what is private, or newer than this Python's Unicode tables.
    return char if unicodedata.category(char) in ("Co", "Cn") else _NO_PICTURE
