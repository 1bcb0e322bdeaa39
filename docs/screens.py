"""Draw the pictures of the documentation: `python docs/screens.py`. Dialogues need tmux."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.terminal_theme import TerminalTheme
from rich.text import Text

from adaptbot_cli.adapters.display.cells import recorder
from adaptbot_cli.cli.common import show_opening
from adaptbot_cli.session.build import Request, build
from adaptbot_cli.workspace import Workspace

HERE = Path(__file__).parent
THEME = TerminalTheme(
    (255, 255, 255),
    (36, 41, 47),
    [
        (36, 41, 47),
        (207, 34, 46),
        (17, 99, 41),
        (122, 82, 0),
        (9, 105, 218),
        (130, 80, 223),
        (27, 124, 131),
        (110, 119, 129),
    ],
)
"""Colours with enough contrast on white, in the order of the ANSI colours."""


def draw(name: str, task: str, answers: str, width: int, world: str | None = None) -> None:
    """Run a task with answers given in YAML, in a world if one is named, and draw the screen."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "answers.yaml"
        told.write_text(answers, encoding="utf-8")
        request = Request(task, "kitchen", model="library", answers=told, world=world)
        console = recorder(width)
        show_opening(console, task, "kitchen", "plan library", "from --model")
        with build(request, Workspace(Path(folder) / "home"), {}, console, None) as session:
            result = session.run()
            session.screen.finish(result, result.revision)
        title = f'adaptbot run "{task}"' + (f" --world {world}" if world else "")
        picture = console.export_svg(title=title, theme=THEME, unique_id=name)
        (HERE / f"{name}.svg").write_text(picture, encoding="utf-8")


def record(name: str, task: str, keys: tuple[str, ...], width: int, lines: int) -> None:
    """Run a task in a real terminal, type keys, each once a question is there, and draw the last
    lines of what stands on it then."""

    def tmux(*arguments: str) -> str:
        command = ["tmux", "-L", "adaptbot-screens", *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    with tempfile.TemporaryDirectory() as folder:
        variables = (
            f"HOME={folder}",
            f"ADAPTBOT_WORKSPACE={folder}/home",
            "ADAPTBOT_MODEL=library",
        )
        entry = f"{Path(sys.executable).parent / 'adaptbot'} run '{task}'"
        shell = f"env -i {' '.join(variables)} PATH={os.environ['PATH']} TERM=tmux-256color {entry}"
        tmux("new-session", "-d", "-x", str(width), "-y", "60", shell)
        try:
            for key in (*keys, ""):
                before, screen = "", tmux("capture-pane", "-p", "-e")
                while screen != before or "?: keys" not in screen:
                    time.sleep(1)
                    before, screen = screen, tmux("capture-pane", "-p", "-e")
                if key:
                    tmux("send-keys", key)
                    time.sleep(1)
        finally:
            tmux("kill-server")
    console = recorder(width)
    for line in screen.rstrip().splitlines()[-lines:]:
        console.print(Text.from_ansi(line), soft_wrap=True)
    picture = console.export_svg(title=f'adaptbot run "{task}"', theme=THEME, unique_id=name)
    (HERE / f"{name}.svg").write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    record("dialogue", "make omelette", ("y", "1"), 80, 30)
    record("dialogue-wide", "make omelette", ("y", "1"), 140, 30)
    draw(
        "omelette",
        "make omelette",
        "chives: {existence: exists, kind: object, obj_location: fridge}",
        140,
    )
    draw(
        "world",
        "make omelette",
        "pan: {mrec_location: sink}\negg: {obj_location: drawer}",
        140,
        "examples/kitchen.ttl",
    )
