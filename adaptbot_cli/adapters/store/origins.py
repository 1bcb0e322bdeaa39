"""Where a fact comes from, in the words of the commit that tells it."""

from pathlib import Path

from adaptbot_cli.adapters.store.git import Repo


def origin_of(root: Path, domain: str, fact: str) -> str:
    """Return the answer behind a fact such as `onion IsLiquid true`, from the latest commit.

    Raises:
        KnowledgeError: the workspace's repository cannot be read.
    """
    for commit in Repo.open_or_init(root).log([f"kg/{domain}"]):
        told = dict(commit.trailers)
        keys = [key for key, value in commit.trailers if value == f"+ {fact}"]
        for key in keys:
            number = key.removeprefix("Fact-")
            return told.get(f"Answer-{number}", f"commit {commit.sha[:7]}")
    return f"from the {domain} as it came"
