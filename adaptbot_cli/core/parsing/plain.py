"""A text with the characters that calls are made of, whatever keyboard or page it comes from."""

import re

_UNSEEN = {0x200B: None, 0x2060: None, 0xFEFF: None}
"""Zero-width space, word joiner, byte order mark: they stand in copied text and say nothing."""

# Only behind a name in ASCII: 拿起苹果（从冰箱） is a sentence with a remark.
_WIDE_CALL = re.compile(r"(?<=[A-Za-z0-9_])[(（][^()（）\n]*[)）]")
_WIDE = str.maketrans("（），：＝＂＇「」『』", '(),:="\'""""')


def plain(text: str) -> str:
    """Return a text with line feeds only, nothing unseen, and calls in ASCII's punctuation.

    `put_down（“apple”，“bowl”）` becomes `put_down(“apple”,“bowl”)`.
    """
    text = text.replace("\r\n", "\n").replace("\r", "\n").translate(_UNSEEN)
    return _WIDE_CALL.sub(lambda call: call[0].translate(_WIDE), text)
