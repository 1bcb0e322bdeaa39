"""The person at the terminal, asked with questionary; and nobody, where there is no terminal.

Importing this package does not import questionary: that is for the first question.
"""

from adaptbot_cli.adapters.terminal.human import AbsentHuman, TerminalHuman

__all__ = ["AbsentHuman", "TerminalHuman"]
