"""From a language model's raw text to plan calls; what is not understood becomes a finding."""

from adaptbot_cli.core.parsing.text import parse

__all__ = ["parse"]
