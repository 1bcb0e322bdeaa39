"""Answers from a file, for a run without a terminal: by subject, then by question."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.questions import LATER, NO, YES, Answer, Question
from adaptbot_cli.errors import KnowledgeError, UsageError


def read_answers(path: Path) -> dict[str, dict[str, Any]]:
    """Read a file of answers: `chives: {existence: exists, obj_location: fridge}`.

    Raises:
        KnowledgeError: the file cannot be read.
        UsageError: it has another form.
    """
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except OSError as error:
        raise KnowledgeError(f"cannot read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is no valid YAML: {error}") from error
    if not isinstance(told, dict) or not all(isinstance(v, dict) for v in told.values()):
        raise UsageError(f"{path} must hold answers by subject: `chives: {{existence: absent}}`")
    return {normal(str(subject)): answers for subject, answers in told.items()}


@dataclass(frozen=True, slots=True)
class AnswersHuman:
    """Answers from a file; what the file does not tell stays open."""

    answers: dict[str, dict[str, Any]]
    by: str

    def ask(self, question: Question) -> Answer:
        """Return the file's answer to a question, by its kind or by the property it asks for."""
        told = self.answers.get(normal(question.about), {})
        value = told.get(question.prop or question.kind, told.get(question.kind))
        if value is None and told and question.kind == "kind":
            value = question.choices[0].value  # what the plan takes it for, unless it is told
        if value is None:
            return LATER
        shown = {True: YES, False: NO}[value] if isinstance(value, bool) else str(value)
        return Answer(shown, self.by)

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Accept: whoever wrote the file has said so."""
        return True
