"""Where the files are that travel with the program: packs, prompts, transcripts, the starter."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def bundled(kind: str) -> Path:
    """Return `kg`, `prompts`, `transcripts` or `starter`: the wheel's folder or the checkout's."""
    installed = _PACKAGE / "bundled" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind
