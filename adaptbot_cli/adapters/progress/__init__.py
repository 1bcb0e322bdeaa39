"""Progress lines as pictures: for the terminal, as SVG, as Mermaid."""

from adaptbot_cli.adapters.progress.mermaid import mermaid
from adaptbot_cli.adapters.progress.svg import svg
from adaptbot_cli.adapters.progress.terminal import progress_lines

__all__ = ["mermaid", "progress_lines", "svg"]
