"""`adaptbot kg add`, `set`, `retract`, `revert`: teaching and taking back, without a task."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    ASKING,
    AnswersOption,
    Consent,
    DryRunOption,
    Place,
    YesOption,
    agreed,
    console,
    note,
    print_json,
    terminal,
)

if TYPE_CHECKING:
    from rich.console import RenderableType

    from adaptbot_cli.session.change import ProposedChange
    from adaptbot_cli.session.home import Home


def put(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="A thing of this home.", autocompletion=completion.things
        ),
    ],
    prop: Annotated[str, typer.Argument(metavar="PROPERTY", help="What of it, such as place.")],
    value: Annotated[str, typer.Argument(metavar="VALUE", help="yes, no, a place, a number …")],
    place: Place = ANYWHERE,
    consent: Consent = ASKING,
) -> int:
    """Say what is true of a thing, in place of what is known: kg set egg place cabinet."""
    from adaptbot_cli.session import change

    home = place.home()
    proposal = change.put(home, name, prop, value)
    change.judge(home, proposal.delta)
    return _with_verdicts(home, proposal, consent)


def retract(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A thing, another name, an absence.",
            autocompletion=completion.things,
        ),
    ],
    prop: Annotated[str, typer.Argument(metavar="[PROPERTY]", help="Only this fact of it.")] = "",
    value: Annotated[
        str, typer.Argument(metavar="[VALUE]", help="Which one, if there are several.")
    ] = "",
    place: Place = ANYWHERE,
    consent: Consent = ASKING,
) -> int:
    """Take back that something is not here, another name, a fact, or a thing with all its facts."""
    from adaptbot_cli.session import change

    home = place.home()
    return _with_verdicts(home, change.retract(home, name, prop, value), consent)


def revert(
    revision: Annotated[
        str | None,
        typer.Argument(
            metavar="[REV]",
            help="A commit, or an answer; see kg log.",
            autocompletion=completion.revisions,
        ),
    ] = None,
    answer: Annotated[
        str | None, typer.Option("--answer", metavar="ID", help="One answer; see kg log or why.")
    ] = None,
    place: Place = ANYWHERE,
    consent: Consent = ASKING,
) -> int:
    """Undo what one commit or one answer taught, with all that follows from it; nothing else.

    Later work stays. The plans of the library that are judged otherwise then are named.
    """
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import change

    if (revision is None) == (answer is None):
        raise UsageError("say what to undo: a commit REV, or --answer ID; kg log tells both")
    home = place.home()
    undone = change.revert(home, revision) if revision else change.revert_answer(home, str(answer))
    return _with_verdicts(home, undone, consent)


def carry_out(
    home: "Home",
    proposal: "ProposedChange",
    consent: Consent,
    more: "RenderableType | None" = None,
    extra: dict[str, Any] | None = None,
) -> int:
    """Show a change, have it agreed to, commit it; return the exit code.

    `more` is shown below the change, `extra` is what `--json` tells besides it.

    Raises:
        UsageError: there is nobody to ask, and --yes was not said.
        KnowledgeError: the change cannot be made.
    """
    from adaptbot_cli.adapters.display.cells import GOOD, WARNING, noted, plain_text
    from adaptbot_cli.adapters.display.origins import preview
    from adaptbot_cli.core.view.changes import as_json
    from adaptbot_cli.session import change

    out = console(stderr=consent.json)
    words = home.words.also(proposal.delta.added).also(proposal.delta.removed)
    if proposal.delta:
        out.print(preview(proposal.changes, words))
    else:
        out.print(plain_text("nothing would change: it is so already", "dim"))
    for text in proposal.notes:
        out.print(noted(WARNING, text))
    if more is not None:
        out.print(more)
    revision = None
    if proposal.delta and consent.dry_run:
        change.judge(home, proposal.delta)
    if proposal.delta and not consent.dry_run:
        if not (consent.yes or agreed(out, "Commit this?")):
            out.print(plain_text("nothing was changed", "dim"))
            return 0
        revision = change.commit(home, proposal)
        out.print(noted(GOOD, f"committed as {(revision or '')[:7]}"))
    if consent.json:
        print_json({"revision": revision, **as_json(proposal.changes, words), **(extra or {})})
    return 0


def _with_verdicts(home: "Home", proposal: "ProposedChange", consent: Consent) -> int:
    """Carry out a change; name the plans that are judged otherwise then."""
    from adaptbot_cli.adapters.display.origins import verdicts
    from adaptbot_cli.session import change

    changed = change.verdicts(home, proposal.delta)
    return carry_out(
        home,
        proposal,
        consent,
        more=verdicts(changed),
        extra={"plans": [{"task": t, "before": old, "after": new} for t, old, new in changed]},
    )


def undo(
    suggestions: Annotated[
        bool,
        typer.Option("--suggestions", help="All answers that were taken as they were suggested."),
    ] = False,
    place: Place = ANYWHERE,
    consent: Consent = ASKING,
) -> int:
    """Take back the last thing that was learned, shown first; again for the one before it."""
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import change

    home = place.home()
    if suggestions:
        return _with_verdicts(home, change.suggestions(home), consent)
    plan = change.last_plan(home)
    if plan is not None:
        return _plan_taken_back(home, plan, consent)
    latest, done = change.last_learned(home), change.last_done(home)
    hint = f"what the robot did or saw last is no answer: adaptbot kg revert {(done or '')[:7]}"
    if latest is None:
        text = f"nothing that was learned of the {home.domain} is left to take back"
        raise UsageError(f"{text}; {hint}" if done else text)
    if done:
        note(hint)
    return _with_verdicts(home, change.revert(home, latest), consent)


def _plan_taken_back(home: "Home", proposal: "ProposedChange", consent: Consent) -> int:
    """Carry out that a kept plan is dropped, or the one before it put back."""
    from adaptbot_cli.adapters.display.cells import GOOD, noted, plain_text
    from adaptbot_cli.session.change import commit

    out, revision = console(stderr=consent.json), None
    out.print(plain_text(f"- {proposal.subject}", "", 1_000))
    if not consent.dry_run and (consent.yes or agreed(out, "Commit this?")):
        revision = commit(home, proposal)
        out.print(noted(GOOD, f"committed as {(revision or '')[:7]}"))
    if consent.json:
        print_json({"revision": revision, "plan": next(iter(proposal.plans))})
    return 0


def add(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="What there is in this home.", autocompletion=completion.things
        ),
    ],
    answers: AnswersOption = None,
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    place: Place = ANYWHERE,
) -> None:
    """Teach a thing without a task: what it is, where it is kept, what is true of it.

    Of a thing that is known already, what is not known of it yet is asked.
    """
    from adaptbot_cli.adapters.display.cells import GOOD, count, noted, plain_text
    from adaptbot_cli.session.additions import teach

    home = place.home()
    lessons, revision = teach(home, name, answers, terminal(), yes, dry_run)
    out = console()
    for lesson in lessons:
        out.print(noted(GOOD, lesson.sentence))
    if revision:
        text = f"{count(len(lessons), 'lesson')} committed as {revision[:7]}"
    elif lessons:
        text = "nothing was changed"
    else:
        text = "nothing was learned: there is nothing to ask, or it was left open"
    out.print(plain_text(text, "dim"))
