"""Everything that is wrong with a domain pack and its plan library."""

from typing import TYPE_CHECKING

from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.kg import Kg


def check_pack(workspace: Workspace, domain: str) -> tuple["Kg | None", list[str], list[str]]:
    """Return a domain's graph, a sentence for each fault, and hints: file, entry, what to do.

    Hints are of what tasks name and the home lacks, and of goals that say too little.
    With a fault the graph may be None, and is good for nothing but a look.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder cannot be read.
    """
    from adaptbot_cli.adapters.planner.checking import library_faults
    from adaptbot_cli.adapters.store.keeper import settled
    from adaptbot_cli.adapters.store.reading import check_files
    from adaptbot_cli.core.refine.goals import weak

    files = settled(workspace.root, lambda: workspace.files(domain))
    kg, found, hints = check_files(files)
    if kg is not None and kg.domain.name not in ("", domain):
        text = f'rdfs:label is "{kg.domain.name}" in the folder {domain}'
        found.append(f'domain.ttl, entry {kg.domain.name}: {text}; write "{domain}"')
    found += library_faults(workspace.library(domain), kg)
    return kg, found, hints if found or kg is None else [*hints, *weak(kg)]
