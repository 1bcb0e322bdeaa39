"""Draw the pictures of the README: `python docs/screens.py`."""

import io
import tempfile
from pathlib import Path

from rich.console import Console
from rich.terminal_theme import TerminalTheme

from adaptbot_cli.cli.common import show_opening
from adaptbot_cli.session import Request, build
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
        console = Console(
            record=True,
            width=width,
            file=io.StringIO(),
            highlight=False,
            force_terminal=True,
            color_system="standard",
        )
        show_opening(console, task, "kitchen", "plan library", "from --model")
        with build(request, Workspace(Path(folder) / "home"), {}, console, None) as session:
            result = session.run()
            session.screen.finish(result, result.revision)
        title = f'adaptbot run "{task}"' + (f" --world {world}" if world else "")
        picture = console.export_svg(title=title, theme=THEME, unique_id=name)
        (HERE / f"{name}.svg").write_text(picture, encoding="utf-8")


if __name__ == "__main__":
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
