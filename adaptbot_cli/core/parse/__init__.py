"""From a language model's raw text to plan calls; what is not understood becomes a finding."""

from collections.abc import Callable

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.parse.text import parse
from adaptbot_cli.core.plan import Parsed

__all__ = ["Vocabulary", "parse", "parser"]


def parser(kg: Kg) -> Callable[[str], Parsed]:
    """Return a parser that also reads phrases, with the words of a home as they are by then."""
    return lambda text: parse(text, Vocabulary.of(kg))
