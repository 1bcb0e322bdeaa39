"""What the workspace held at an earlier revision."""

from pathlib import Path

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import DOMAIN_FILES, FACT_FILES


def files_at(root: Path, domain: str, revision: str) -> dict[str, bytes]:
    """Return a domain's files as they were at a revision.

    Raises:
        KnowledgeError: the workspace has no such revision.
    """
    repo = Repo.open_or_init(root)
    names = (*DOMAIN_FILES, *FACT_FILES)
    found = {name: repo.read(f"kg/{domain}/{name}", revision) for name in names}
    return {name: data for name, data in found.items() if data is not None}


def head(root: Path) -> str | None:
    """Return the revision that the workspace is at."""
    return Repo.open_or_init(root).head()
