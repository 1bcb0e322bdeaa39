"""How a person teaches an action: the dialogue, what it may be made of, and its facts."""

from adaptbot_cli.core.ask.new_action.talk import TaughtAction, Unknown, played

__all__ = ["TaughtAction", "Unknown", "played"]
