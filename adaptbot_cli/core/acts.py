"""Executing a checked plan in a world, step by step (Algorithm 1, execute); what to ask the person
about a step that failed."""

from collections.abc import Generator, Iterable, Iterator
from dataclasses import replace
from typing import Any

from rdflib import XSD, URIRef

from adaptbot_cli.core.ask import teach
from adaptbot_cli.core.ask.agenda import place_property
from adaptbot_cli.core.ask.learning import attribute_question
from adaptbot_cli.core.ask.questions import (
    AGAIN,
    AT,
    BY_HAND,
    IS_NOT,
    IS_SO,
    LATER,
    NO,
    SKIP,
    STOP,
    UNKNOWN,
    YES,
    Answer,
    Choice,
    Question,
)
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.terms import ATTRIBUTES, TRUE
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Done, Finding, Step
from adaptbot_cli.core.refine.goals import check_goal
from adaptbot_cli.core.refine.repair import change_of, key_of
from adaptbot_cli.core.report import GroundAction, Outcome, Outside, Report
from adaptbot_cli.core.request.understand import excluded
from adaptbot_cli.core.run import Acting, Run, look_at, refuted_last
from adaptbot_cli.core.turns import Act, Ask, Begin, Believe, Kept, Learned, Stop, Surprised, Turn
from adaptbot_cli.core.world import LOST, REFUSED, STOPPED, Acted, Seen, believe, is_irreversible

MOST_AGAIN = 2
"""How often a step is tried again from where it was tried before, until somebody is asked."""

MOST_ACTS = 1_000
"""How many steps one run tries at most, so that it ends in a world that is never the same."""

GOAL_MET = "goal met"
"""The reason that `Stop` gives a world at the end of a task that has met its goal."""

_UNDONE = "what it brings about does not last"
"""Why a step has failed that was done again and again from the same state."""

_ALL = "all"
_AGREE = (
    Choice(YES, "yes, do it", key="y"),
    Choice(_ALL, "yes, and the rest without asking", key="a"),
    Choice(NO, "no, stop here", key="n"),
)


def begin(run: Run, acting: Acting) -> Generator[Turn, Any, bool]:
    """Start the world; return whether its first observation contradicts the belief."""
    acting.begun = True
    seen: Seen = yield Begin(run.task)
    delta, surprise = _believed(run, acting, Delta(), seen)
    yield from _keep(run, acting, delta, surprise)
    return bool(surprise)


def act(run: Run, acting: Acting, report: Report, heed: bool = True) -> Generator[Turn, Any, bool]:
    """Carry out a plan until it ends, a step has findings or fails, or, with `heed`, something
    surprises.

    Return whether it came to its end. What is `left` then are the steps from the failed one on.
    """
    for place, (step, ground) in enumerate(zip(report.steps, report.grounded, strict=True)):
        acting.left, acting.at = rest(report.steps[place:]), place
        if step.status == "finding":
            break
        if ground is None or step.status == "dropped":
            acting.passed.append((step, ground, Delta()))
            acting.at = place + 1
            continue
        agreed = yield from _agreed(run, acting, step, ground)
        if not agreed or len(acting.acts) >= MOST_ACTS:
            acting.over = REFUSED
            break
        expected = change_of(ground, run.kg)
        seen: Seen | None = yield Act(len(acting.acts) + 1, step, ground, expected)
        if seen is None:
            acting.over = STOPPED
            break
        brought = expected.added and expected.added <= seen.observed
        if seen.failed and brought and not seen.over:
            step = replace(step, reason=f"{seen.failed}, but it is seen to be done")
            seen = replace(seen, failed="")
        standing = net(acting.changes)
        delta, surprise = _believed(run, acting, Delta() if seen.failed else expected, seen)
        tried = Acted(step, ground, delta, surprise, seen.failed, standing)
        if not seen.failed and _as_often(acting, tried) >= MOST_AGAIN:
            seen = replace(seen, failed=_UNDONE)
        _log(run, acting, replace(tried, failed=seen.failed))
        if not seen.failed:
            acting.left, acting.at = rest(report.steps[place + 1 :]), place + 1
        yield from _keep(run, acting, delta, surprise)
        acting.over = seen.over
        if seen.over or seen.failed or (heed and surprise and acting.left):
            break
    else:
        return True
    return False


def _as_often(acting: Acting, tried: Acted) -> int:
    """How often a step was tried from the same state with the same outcome, since the person last
    helped."""
    since = acting.acts[(acting.helps or [0])[-1] :]
    key = key_of(tried.ground), tried.standing, bool(tried.failed)
    return sum((key_of(act.ground), act.standing, bool(act.failed)) == key for act in since)


def _log(run: Run, acting: Acting, tried: Acted) -> None:
    acting.acts.append(tried)
    why = tried.failed or tried.step.reason
    done: Done = "failed" if tried.failed else "done"
    acting.passed.append((replace(tried.step, done=done, reason=why), tried.ground, tried.delta))
    if not tried.failed:
        run.scene.done |= set(tried.ground.values.values())


def by_hand(run: Run, acting: Acting) -> Generator[Turn, Any, None]:
    """Mark the last step as done by the person."""
    last = acting.acts[-1]
    expected = change_of(last.ground, run.kg)
    run.kg.apply(expected)
    acting.helps.append(len(acting.acts))
    _log(run, acting, Acted(last.step, last.ground, expected))
    yield from _keep(run, acting, expected, Delta())


def _keep(run: Run, acting: Acting, delta: Delta, surprise: Delta) -> Generator[Turn, Any, None]:
    """Commit what was done and observed at once, so that nothing later can lose it."""
    acting.changes.append(delta)
    if surprise:
        acting.surprises.append(surprise)
        yield Surprised(surprise)
    if delta:
        step = f"{len(acting.acts)}. {describe(acting.acts[-1])}" if acting.acts else ""
        kept: Kept = yield Believe(run.task, delta, step)
        run.revision = kept.revision or run.revision


def describe(act: Acted) -> str:
    """Format an attempted step: its call, and why it failed."""
    call = act.step.call.render()
    return f"{call} failed: {act.failed}" if act.failed else call


def rest(steps: Iterable[Step]) -> str:
    """Return steps as a plan's text, without inserted ones: repair finds those where needed."""
    kept = (step for step in steps if step.status not in ("inserted", "dropped"))
    return "\n".join(step.call.render() for step in kept)


def _agreed(
    run: Run, acting: Acting, step: Step, ground: GroundAction
) -> Generator[Turn, Any, bool]:
    """Ask the person to confirm a step if `confirm` says so; an absent person refuses."""
    wanted = acting.confirm == "each" or (
        acting.confirm == "irreversible" and is_irreversible(ground.action, run.kg.domain)
    )
    if not wanted:
        return True
    call = step.call.render()
    number = str(len(acting.acts) + 1)
    question = Question("confirm", call, f"Shall the robot do {call}?", number, choices=_AGREE)
    answer: Answer = yield Ask(question)
    if answer.value != LATER.value:
        run.usage = replace(run.usage, questions=run.usage.questions + 1)
    if answer.value == _ALL:
        acting.confirm = "none"
    return answer.value in (YES, _ALL)


def stop(run: Run, acting: Acting, report: Report) -> Generator[Turn, Any, tuple[Report, Outcome]]:
    """Stop the world; return the whole plan as executed, and its outcome.

    What is asked for is judged on what is believed then, and by the world itself where it can.
    """
    unmet, missing = check_goal(run.scene)
    error = _error(acting, report)
    why = GOAL_MET if not unmet and error is None else error.message if error else "goal not met"
    seen: Seen = yield Stop(run.task, why)
    delta, surprise = _believed(run, acting, Delta(), seen)
    yield from _keep(run, acting, delta, surprise)
    if surprise:
        unmet, missing = check_goal(run.scene)
    if error is not None:
        unmet = ()
    elif seen.goal is False and not unmet:
        why = f": {seen.failed}" if seen.failed else ""
        unmet = (Finding("E603", f"the world says that the goal is not met{why}"),)
    else:
        unmet += tuple(_ruled_out(run, acting))
    whole = carried_out(acting, report)
    return whole, Outcome(whole.deltas, error, unmet, missing)


def _believed(run: Run, acting: Acting, expected: Delta, seen: Seen) -> tuple[Delta, Delta]:
    """Believe what was seen of states; of what things are like it is only noted."""
    acting.claims |= {fact for fact in seen.observed if run.kg.home_of(fact[1]) == ATTRIBUTES}
    return believe(run.kg, expected, seen)


def _ruled_out(run: Run, acting: Acting) -> Iterator[Finding]:
    """What the request excludes by what the world says that a thing is like: only a person's word
    makes that known, but no goal is met against it."""
    used = {node for act in acting.acts if not act.failed for node in act.ground.values.values()}
    with run.kg.rehearsal():
        for fact in sorted(acting.claims):
            run.kg.apply(run.kg.with_fact(fact, run.kg.facts.triples((*fact[:2], None))))
        for thing in sorted(used, key=str) if acting.claims else ():
            if why := excluded(thing, run.task, run.kg):
                yield Finding("E603", f"the world says otherwise: {why}", run.kg.name(thing))


def _error(acting: Acting, report: Report) -> Finding | None:
    """What kept the plan from completing, None if nothing did."""
    number = len(acting.acts)
    if acting.over == LOST:
        failed = acting.acts[-1].failed if acting.acts else ""
        return Finding("E602", f"the world can no longer be asked: {failed}", step=number or None)
    if all(step.status == "dropped" for step in report.steps[acting.at :]):
        return None
    steps = f"stopped after {number} step{'s' * (number != 1)}; what was seen is kept"
    why = next((f"{finding.message}; " for finding in report.blocking), "")
    found = failure(acting)
    if found is not None:
        return replace(found, step=len(acting.passed))
    return Finding("E604", f"{'' if acting.over else why}{steps}", prop=acting.over)


def failure(acting: Acting) -> Finding | None:
    """Return the last step's finding, None if it did not fail."""
    last = acting.acts[-1] if acting.acts else None
    if last is None or not last.failed:
        return None
    message = f"{last.step.call.render()} failed: {last.failed}"
    return Finding("E601", message, last.step.call.action)


def carried_out(acting: Acting, report: Report) -> Report:
    """Return the plan as executed: the steps behind, then those still to come."""
    left = zip(report.steps[acting.at :], report.grounded[acting.at :], strict=True)
    to_come = [
        (step if step.status == "dropped" else replace(step, done="not tried"), ground, Delta())
        for step, ground in left
    ]
    whole = [*acting.passed, *to_come]
    steps, grounded, deltas = (
        (tuple(each) for each in zip(*whole, strict=True)) if whole else ((),) * 3
    )
    before = len(acting.passed) - acting.at
    findings = tuple(
        replace(f, step=f.step and f.step + before, steps=tuple(n + before for n in f.steps))
        for f in report.findings
        if f.code != "E601"
    )
    return replace(report, steps=steps, grounded=grounded, deltas=deltas, findings=findings)


def outside(acting: Acting) -> Outside:
    """Summarise failures, recoveries and surprises for the result.

    A failure is recovered from if a later step was done and the person did not help in between.
    """
    seen = {fact: None for surprise in acting.surprises for fact in sorted(surprise.added)}
    recovered = 0
    for n, act in enumerate(acting.acts):
        if act.failed:
            later = (m for m in range(n + 1, len(acting.acts)) if not acting.acts[m].failed)
            done = next(later, None)
            recovered += done is not None and not any(n < help <= done for help in acting.helps)
    failed = sum(bool(act.failed) for act in acting.acts)
    changes, surprise = net(acting.changes), net(acting.surprises)
    return Outside(failed, recovered, tuple(seen), changes, surprise)


def placed(run: Run, act: Acted) -> list[tuple[URIRef, URIRef]]:
    """Return the movable things of a step, each with its location property."""
    hands = set(run.kg.instances(k.iri for k in run.kg.domain.classes.values() if k.hand))
    things = (v for v in act.ground.values.values() if isinstance(v, URIRef) and v not in hands)
    found = ((thing, place_property(thing, run.scene)) for thing in things)
    return [(thing, prop.iri) for thing, prop in found if prop is not None]


def lost(run: Run, act: Acted) -> list[tuple[URIRef, URIRef]]:
    """Return the things of a step whose place is unknown: in no place, and not with the robot."""
    with_robot = set(run.kg.facts.objects(run.kg.domain.agent, None))
    return [
        (thing, prop)
        for thing, prop in placed(run, act)
        if run.kg.value(thing, prop) is None and thing not in with_robot
    ]


def is_hopeless(run: Run, acting: Acting) -> bool:
    """Tell whether the last step failed and trying it again would be in vain: it was tried often
    enough from this state without help, or the place of a thing that it takes is unknown."""
    last = acting.acts[-1] if len(acting.acts) > (acting.helps or [0])[-1] else None
    if last is None or not last.failed:
        return False
    again = last.failed != _UNDONE and _as_often(acting, last) <= MOST_AGAIN
    return bool(lost(run, last)) or not again


def with_failure(acting: Acting, report: Report) -> Report:
    """Return the remaining plan with its first step's failure as a finding."""
    found = failure(acting)
    return report if found is None else replace(report, findings=(found, *report.findings))


def ask_what_now(run: Run, acting: Acting, report: Report) -> Generator[Turn, Any, Report]:
    """Ask what to do about the step that failed last; return the report on the remaining plan.

    Where it is not known any more where a thing is, that is asked; else what the person knows.
    """
    finding = failure(acting)
    if finding is None or run.stopped:
        return report
    last, why = acting.acts[-1], finding.message
    missed = lost(run, last)
    question = _where(run, *missed[0], why) if missed else _what_now(run, acting, why)
    answer = yield from _answered(run, question)
    if answer is None:
        return report
    lines = acting.left.splitlines()
    if answer.value.startswith(AT):
        name = answer.value.removeprefix(AT)
        found = next(each for each in placed(run, last) if normal(run.kg.name(each[0])) == name)
        question = _where(run, *found, why)
        answer = yield from _answered(run, question)
        if answer is None:
            return report
    elif answer.value.startswith((IS_SO, IS_NOT)):
        denied = _attributes(run, last)
        question, value = next((q, v) for q, v in denied if _denial(q, v) == answer.value)
        answer = replace(answer, value=value)
    elif answer.value == BY_HAND:
        yield from by_hand(run, acting)
    if answer.value in (BY_HAND, SKIP) and last.step.status != "inserted":
        lines = lines[1:]
    if question.kind in ("place", "attribute"):
        yield from _teach(run, report, question, answer)
    acting.left = "\n".join(lines)
    if not lines:
        return Report(run.task, "", (), ())
    return (yield from look_at(run, acting.left))


def _answered(run: Run, question: Question) -> Generator[Turn, Any, Answer | None]:
    """The person's answer, None if it was put off or is unknown."""
    answer: Answer = yield Ask(question)
    run.asked[question.key] = (question, answer)
    run.stopped = run.stopped or answer.value == STOP.value or answer.last
    if answer.value in (LATER.value, STOP.value, UNKNOWN):
        return None
    run.usage = replace(run.usage, questions=run.usage.questions + 1)
    return answer


def _teach(
    run: Run, report: Report, question: Question, answer: Answer
) -> Generator[Turn, Any, None]:
    """Learn the answer unchecked for contradictions: the world has just refuted the belief."""
    run.asked[question.key] = (question, answer)
    for lesson in teach.lessons(question, answer, report, run.scene, run.asked):
        teach.accept(lesson, run.scene)
        run.lessons.append(lesson)
        yield Learned(lesson)


def _where(run: Run, entity: URIRef, prop: URIRef, why: str) -> Question:
    name = normal(run.kg.name(entity))
    question = attribute_question(run.kg, name, run.kg.domain.properties[prop], "")
    question = refuted_last(run, question)
    notes = (why, *(f"seen: {sentence}" for sentence in run.seen(3, name)))
    return replace(question, notes=notes, text=f'Where is "{name.replace("_", " ")}"?')


def _attributes(run: Run, last: Acted) -> Iterator[tuple[Question, str]]:
    """The attributes the step requires, as questions, each with the answer that denies it."""
    for need in last.ground.action.attributes:
        entity = last.ground.values.get(need.of)
        prop = run.kg.domain.properties.get(need.prop)
        if entity is not None and prop is not None:
            name = normal(run.kg.name(entity))
            value = NO if need.value == TRUE else YES
            yield attribute_question(run.kg, name, prop, ""), value
    # What a condition asks of an attribute that is known may be known wrongly.
    asked = {p for c in last.ground.action.conditions for p in c.predicates}
    props = [p for p in run.kg.domain.properties.values() if p.iri in asked]
    for prop in (p for p in props if p.graph == "attribute" and p.range == XSD.boolean):
        for entity in last.ground.values.values():
            known = run.kg.value(entity, prop.iri)
            if known is not None:
                name = normal(run.kg.name(entity))
                yield attribute_question(run.kg, name, prop, ""), NO if known == TRUE else YES


def _denial(question: Question, value: str) -> str:
    """The choice that denies an attribute the step requires."""
    return f"{IS_SO if value == YES else IS_NOT}{question.prop} {question.about}"


def _what_now(run: Run, acting: Acting, why: str) -> Question:
    last = acting.acts[-1]
    choices = [
        Choice(AGAIN, "try it again"),
        Choice(BY_HAND, "it is done now: I have seen to it"),
        Choice(SKIP, "leave it out"),
    ]
    for entity, _ in placed(run, last):
        name = normal(run.kg.name(entity))
        choices.append(Choice(f"{AT}{name}", f"{name.replace('_', ' ')} is somewhere else"))
    for question, value in _attributes(run, last):
        text = f"{question.about.replace('_', ' ')}: {question.label} {value}"
        choices.append(Choice(_denial(question, value), text))
    choices.append(Choice(LATER.value, "I cannot say: stop here"))
    about = normal(
        next((run.kg.name(v) for v in last.ground.values.values()), last.step.call.action)
    )
    return Question(
        "failed",
        about,
        f"{why}. What now?",
        last.step.call.action,
        choices=tuple(dict.fromkeys(choices)),
        notes=tuple(f"seen: {sentence}" for sentence in run.seen(3)),
    )
