"""Where the files are that travel with the program: domain packs, prompts, transcripts."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def bundled(kind: str) -> Path:
    """Return the folder `kg`, `prompts` or `transcripts`: the wheel's, or else the checkout's."""
    installed = _PACKAGE / "bundled" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind
