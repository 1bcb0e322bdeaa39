"""Transcripts: every turn of a run as one YAML document, to read, to replay and to resume.

A scripted transcript is the same format written by hand: it must tell every plan and every answer,
and may leave out what it does not want to pin down.
"""

from adaptbot_cli.adapters.transcript.documents import FORMAT, Document, describe, dump, finished
from adaptbot_cli.adapters.transcript.memory import Memory, RememberingHuman, RememberingPlanner
from adaptbot_cli.adapters.transcript.player import Player
from adaptbot_cli.adapters.transcript.reading import (
    LeftOver,
    glanced,
    has_end,
    header_of,
    left_over,
    read,
    read_cut,
    text_of,
    unfinished,
)
from adaptbot_cli.adapters.transcript.recorder import Recorder

__all__ = [
    "FORMAT",
    "Document",
    "LeftOver",
    "Memory",
    "Player",
    "Recorder",
    "RememberingHuman",
    "RememberingPlanner",
    "describe",
    "dump",
    "finished",
    "glanced",
    "has_end",
    "header_of",
    "left_over",
    "read",
    "read_cut",
    "text_of",
    "unfinished",
]
