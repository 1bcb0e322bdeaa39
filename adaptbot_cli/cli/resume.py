"""`adaptbot resume`: go on with a run that was cut off."""

from typing import Annotated, Any

import typer

from adaptbot_cli.cli.common import (
    JsonOption,
    MaxCostOption,
    MaxTokensOption,
    TimeoutOption,
    WorkspaceOption,
    console,
    domain_name,
    note,
    opened,
    workspace,
)
from adaptbot_cli.cli.run import pursue

_ORIGIN = "the interrupted run"
"""Where the model comes from, unless that run did not tell it."""


def resume(
    run: Annotated[
        str, typer.Argument(metavar="[ID]", help="A transcript; without it, the latest cut off.")
    ] = "",
    timeout: TimeoutOption = None,
    max_tokens: MaxTokensOption = None,
    max_cost: MaxCostOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Go on with a run that was cut off, from the answers it had.

    Its limits hold on, and what it has spent of tokens and dollars counts.
    """
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.core.visible import visible

    home = workspace(workspace_dir)
    path = session.cut_off(home, run)
    header = session.header_of(path)
    domain = domain_name(_text(header, "domain") or None, home)
    screen = console(stderr=json)
    screen.print(Text(visible(f"going on with {path.stem}"), "dim"), soft_wrap=True)
    record = session.guarded(header)
    own = session.is_own(path, header)
    if not own:
        its = ", ".join(["answers", *record])
        note(f"{path} is of no run of yours: its {its} ignored until `adaptbot trust {path}`")
        record = {"model": "library"} if record.get("model") == "library" else {}
    model, base = _text(record, "model") or None, _text(record, "api_base") or None
    chosen = opened(screen, home, _text(header, "task"), domain, model, base, _ORIGIN)
    limits = {**home.settings, **record} if not own else record
    request = session.Request(
        task=_text(header, "task"),
        domain=domain,
        chosen=chosen,
        policy=header.get("policy", "tutor"),
        replans=min(header.get("replans", 3), 20),
        requires=tuple(header.get("requires") or ()),
        without=tuple(header.get("without") or ()),
        apply=own and header.get("apply") is True,
        timeout=timeout if timeout is not None else limits.get("timeout"),
        max_tokens=max_tokens if max_tokens is not None else limits.get("max_tokens"),
        max_cost=max_cost if max_cost is not None else limits.get("max_cost"),
        temperature=header.get("temperature", 0.0),
        seed=header.get("seed", 0),
        full=header.get("full") is True,
        edit=header.get("edit") is True,
        resumes=path,
        world=record.get("world"),
        noise=header.get("world_noise", 0.0),
        act_timeout=header.get("act_timeout", 60.0),
        confirm=header.get("confirm", "none"),
        prompt=_text(header, "prompt") or "auto",
    )
    return pursue(request, home, json)


def _text(header: Any, key: str) -> str:
    return str(header.get(key) or "")
