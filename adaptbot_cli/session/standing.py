"""How a workspace stands."""

from adaptbot_cli.core.changes import Changes, Words
from adaptbot_cli.core.standing import Status
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.knowing import Home


def status(home: Home) -> Status:
    """Return how a workspace stands. Edits that cannot be read are told as a problem."""
    from adaptbot_cli.adapters.store.keeper import edit_faults
    from adaptbot_cli.adapters.transcript import unfinished

    root, versions = home.workspace.root, home.versions
    if versions is None:
        return Status(root, home.domain)
    last = next(versions.repo.log([versions.folder]), None)
    head = versions.repo.head()
    changes, problem, found = None, "", []
    if head:
        try:
            changes = versions.between(versions.files(head), versions.files(None))
            found = edit_faults(versions.repo, home.domain) if changes else []
        except KnowledgeError as error:
            problem = str(error)
    waiting = sorted(unfinished(home.workspace.transcripts))
    revision, subject = (last.sha, last.subject) if last else (head, "")
    edited = versions.edited()
    return Status(root, home.domain, revision, subject, edited, changes, problem, found, waiting)


def words_for(home: Home, changes: Changes) -> Words:
    """Return words that know the names of what a change adds and removes as well."""
    known = _words(home)
    return known.also(changes.delta.added).also(changes.delta.removed)


def _words(home: Home) -> Words:
    """The words of the files as they are; those of the last commit if the files are no domain."""
    from adaptbot_cli.adapters.store.reading import load_kg
    from adaptbot_cli.adapters.store.versions import facts_of

    try:
        return home.words
    except KnowledgeError:
        versions = home.needed()
        files = versions.files("HEAD")
        return Words.of(load_kg(files, "HEAD").domain, facts_of(files))
