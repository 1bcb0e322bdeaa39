"""Where the files are that travel with the program: packs, prompts, transcripts, the starter."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def bundled(kind: str) -> Path:
    """Return `kg`, `prompts`, `transcripts` or `starter`: the wheel's folder or the checkout's."""
    installed = _PACKAGE / "bundled" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind


def root_of(path: Path) -> Path | None:
    """Return the workspace below which a file is reached through no link: one in a folder
    `transcripts`, `prompts` or `plans`, unless it travels with the program. None for others."""
    if any(path.is_relative_to(bundled(kind)) for kind in ("prompts", "transcripts", "starter")):
        return None
    kinds = ("transcripts", "prompts", "plans")
    return next((p.parent for p in list(path.parents)[:3] if p.name in kinds), None)
