"""What a commit takes of files that a person has edited and not committed: only the run's own.

The person's edits stay on the disk, and in the index if they were staged, for the person to
commit. Provenance is the reason: what a run commits bears the run's questions and answers.
"""

from collections.abc import Mapping

from adaptbot_cli.adapters.store.committing import Change
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.held import Held
from adaptbot_cli.adapters.store.reading import DOMAIN_FILES, FACT_FILES
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.errors import KnowledgeError


def plan(
    repo: Repo, held: Held, change: Delta, files: Mapping[str, bytes]
) -> tuple[Change, list[str]]:
    """Return what to write and to commit for a change of facts, and the edits that come along.

    `files` are the domain's files after the change, by name, those that differ. Edits come along
    only if what was learned makes no sense without them, such as an attribute of a thing that
    only the edited file has.
    """
    written = {f"{held.where}/{name}": data for name, data in files.items()}
    edited = repo.dirty([f"{held.where}/{name}" for name in (*DOMAIN_FILES, *FACT_FILES)])
    if not edited:
        return Change(written, sorted(written)), []
    apart = _apart(repo, held, change, files)
    if apart is None:
        return Change(written, sorted({*written, *edited})), edited
    staged = _staged(repo, held, change, apart)
    return Change(written, sorted({*written, *apart}), apart, staged), []


def _apart(
    repo: Repo, held: Held, change: Delta, written: Mapping[str, bytes]
) -> dict[str, bytes] | None:
    """What is committed of the files after the change, by path; None if it makes no sense there."""
    head = repo.head()
    names = (*DOMAIN_FILES, *FACT_FILES)
    found = {name: repo.read(f"{held.where}/{name}", head) if head else None for name in names}
    files = {name: data for name, data in found.items() if data is not None}
    try:
        committed = Held.of(files, held.where)
        after = committed.after(change)
        if committed.new_faults(change, after):
            return None
    except KnowledgeError:
        return None
    return {f"{held.where}/{n}": after.get(n, files[n]) for n in {*written, *after}}


def _staged(repo: Repo, held: Held, change: Delta, apart: Mapping[str, bytes]) -> dict[str, bytes]:
    """What is staged of these files, after the change, by path."""
    found = {}
    for path in apart:
        data = repo.staged(path)
        name = path.removeprefix(f"{held.where}/")
        if data is not None:
            try:
                after = Held(held.where, {**held.files, name: data}, held.kg).after(change)
            except (KnowledgeError, UnicodeDecodeError):
                continue
            found[path] = after.get(name, data)
    return found
