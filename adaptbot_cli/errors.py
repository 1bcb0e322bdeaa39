"""The errors people see. Each is a sentence: what happened, where, what to do.

AdaptbotError            exit 1
├── UsageError           exit 2   an option or argument that cannot be meant
├── KnowledgeError       exit 4   a graph, a domain pack or the workspace
│   └── PackError        exit 4   an entry of a domain pack
├── ModelError           exit 5   the model, or the choice of one
├── ReplayError          exit 3   a transcript that no longer tells the same story
├── WorldError           exit 6   the world that is to carry a plan out
├── LexiconError         exit 7   the word knowledge
└── Interrupted          exit 130 Ctrl-C
"""


class AdaptbotError(Exception):
    """Carries the sentence that the command line prints, and the process's exit code."""

    exit_code = 1


class UsageError(AdaptbotError):
    """An option or argument that cannot be meant."""

    exit_code = 2


class KnowledgeError(AdaptbotError):
    """Something is wrong with a graph, a domain pack or the workspace."""

    exit_code = 4


class PackError(KnowledgeError):
    """An entry of a domain pack is wrong; the message names file, entry and what to do."""


class ModelError(AdaptbotError):
    """No plan could be had from a model, or no model could be chosen.

    `spent` is what it cost in vain: answers, prompt and completion tokens, dollars if known.
    """

    exit_code = 5
    spent: tuple[int, int, int, float | None] = (0, 0, 0, None)


class ReplayError(AdaptbotError):
    """A replay differs from its transcript."""

    exit_code = 3


class WorldError(AdaptbotError):
    """The world that is to carry a plan out cannot be had."""

    exit_code = 6


class LexiconError(AdaptbotError):
    """The word knowledge is missing or damaged."""

    exit_code = 7


class Interrupted(AdaptbotError):
    """The person pressed Ctrl-C."""

    exit_code = 130
