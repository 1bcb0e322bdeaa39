"""From the calls of a plan to a report: understand, rehearse with repairs, check the goal."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice

from rdflib.term import Node

from adaptbot_cli.core.ask.learning import is_absent
from adaptbot_cli.core.graph.sparql import mentions
from adaptbot_cli.core.names import normal, singulars, words
from adaptbot_cli.core.plan import Call, Finding, Parsed
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.expand import expand
from adaptbot_cli.core.refine.goals import check_goal
from adaptbot_cli.core.refine.grounding import Sound, in_order, number, sentence, understand
from adaptbot_cli.core.refine.repair import MOST_ROWS, Aim, aim, all_hold, complete, holds
from adaptbot_cli.core.refine.simulation import Simulation
from adaptbot_cli.core.report import GroundAction, Report
from adaptbot_cli.core.request.understand import trouble
from adaptbot_cli.core.scene import Scene

_OF_A_NAME = frozenset({"E101", "E201"})
_OF_MOVING = frozenset({"E202", "E302"})
_OF_ITS_STEP = frozenset({"E401", "W602"})
"""The codes of findings about a name, of a thing that cannot be moved, and of those about the state
at one step of the plan."""


def words_to_look_up(calls: Iterable[Call], scene: Scene) -> tuple[set[str], set[str]]:
    """Return the unknown item names and the unknown action names of a plan, not yet looked up."""
    items: set[str] = set()
    actions: set[str] = set()
    for call in calls:
        if resolve.action(call.action, scene).action is None:
            actions.add(normal(call.action))
        items |= {normal(arg) for arg in call.args if not number(arg) and not scene.kg.find(arg)}
    items -= {word for a in scene.domain.actions.values() for p in a.parameters for word in p.words}
    known = set(scene.known)
    return items - known, actions - known


def names_to_look_up(unknown: Iterable[str], scene: Scene) -> set[str]:
    """Return the names of things that related words lead to, to see whether they lead back."""
    near = {w.word for word in unknown for w in scene.known.get(word, ()) if w.distance <= 1}
    found = {normal(scene.kg.name(entity)) for word in near for entity in scene.kg.find(word)}
    return found - set(scene.known)


_ROUNDS = 2
"""How often the goals of a task are gone through for steps that bring them about."""


def examine(parsed: Parsed, text: str, scene: Scene) -> Report:
    """Check, refine and repair a plan on the graph, which is left as it was.

    Every finding of the plan is reported at once, each once. State conditions are only checked
    where everything before them about the same things could be understood.
    """
    text_calls = parsed.calls
    parsed = in_order(parsed, scene)
    calls = [written.call for written in parsed.calls]
    scene.notice(calls)
    simulation = Simulation(scene.kg, scene.repair, _needed(calls, scene), bars=scene.bars)
    with scene.kg.rehearsal():
        if scene.spoiled is None or not scene.done:
            scene.spoiled = _spoilers(scene)
        before = scene.spoiled
        for place, written in enumerate(parsed.calls):
            simulation.place = place
            meant = expand(written.call, scene)
            if not meant.calls:
                simulation.skip(written, meant.dropped)
            for call in meant.calls:
                sound = understand(call, scene)
                if meant.change is not None:
                    sound = replace(sound, changes=(meant.change, *sound.changes))
                later = islice(calls, place + 1, None)
                why = _pointless(sound, later, simulation, scene) if scene.repair else ""
                simulation.take(written, sound, why)
        _put_right(simulation, before, scene)
        if scene.repair:
            _reach_goals(simulation, scene)
        checked = parsed.calls and not simulation.tainted
        unmet, missing = check_goal(scene) if checked else ((), ())
        simulation.findings += _slipped_in(simulation, scene)
    absent = _unused(simulation.grounded, parsed, scene)
    seen = [finding.subject for finding in absent]
    unmet = tuple(f for f in unmet if f.subject not in seen)
    found = [
        f.subject for f in simulation.findings if f.code == "E201" and scene.requires(f.subject)
    ]
    findings = (
        *_of_the_request(scene),
        *parsed.findings,
        *_once(simulation.findings),
        *absent,
        *unmet,
    )
    return Report(
        task=scene.task,
        text=text,
        steps=tuple(simulation.steps),
        findings=tuple(dict.fromkeys(findings)),
        grounded=tuple(simulation.grounded),
        deltas=tuple(simulation.deltas),
        missing=tuple(dict.fromkeys((*found, *seen, *missing))),
        written=text_calls,
    )


def _of_the_request(scene: Scene) -> Iterable[Finding]:
    """What the request itself leaves open: words not understood, what it asks for and excludes."""
    task = scene.task
    for phrase in task.unread:
        yield Finding("W604", f'"{phrase}" of the request is {trouble(phrase)}', phrase)
    if task.thin:
        message = f'no goal is known for "{task.name}": that it can be executed is all I can tell'
        yield Finding("W606", message, task.name)
    called = {part for word in words(task.name) for part in (word, *singulars(word))}
    named = (name for name in task.excluded if set(words(name)) <= called)  # lime tea without lime
    for name in (*task.required, *named):
        why = scene.excludes(name)
        if why:
            yield Finding("E505", f"{name} is asked for, and {why}", name)


def _slipped_in(simulation: Simulation, scene: Scene) -> Iterable[Finding]:
    """The steps that deal with something excluded without naming it: by default, in a vessel; and
    those that do what the request excludes."""
    task = scene.task
    if not task.barred and not task.rules and not task.refused:
        return
    found = {f.step for f in simulation.findings if f.code == "E505"}
    for n, (ground, delta) in enumerate(
        zip(simulation.grounded, simulation.deltas, strict=True), start=1
    ):
        action = ground.action.name if ground else ""
        named = {"", *(scene.kg.name(v) for v in ground.values.values())} if ground else set()
        taken = ground.action.visible[0].classes if ground and ground.action.visible else ()
        for refused, thing in task.refused:
            # What the action does not take itself it is done to in a vessel: eggs that are stirred.
            inside = not any(scene.kg.is_a(e, taken) for e in scene.kg.find(thing))
            if refused == action and (thing in named or inside):
                text = f"the request excludes {action} {thing}".strip().replace("_", " ")
                yield Finding("E505", text, action, step=n)
        used = {*(ground.values.values() if ground else ())}
        used |= {node for s, _, o in delta.added for node in (s, o)}
        things = sorted(filter(None, {scene.excluded(node) for node in used}))
        if things and n not in found:
            yield Finding("E505", things[0], simulation.steps[n - 1].call.action, step=n)


def _needed(calls: Sequence[Call], scene: Scene) -> dict[tuple[Node | None, Node], int]:
    """The last place at which a step needs a predicate of a thing that it names; of None, where it
    does not name all that it is done with."""
    needed: dict[tuple[Node | None, Node], int] = {}
    for place, call in enumerate(calls):
        known = resolve.action(call.action, scene).action
        if known is None:
            continue
        named: list[Node | None] = [entity for arg in call.args for entity in scene.kg.find(arg)]
        things = [*named, *([None] if len(call.args) < len(known.parameters) else [])]
        predicates = {p for condition in known.conditions for p in condition.predicates}
        needed |= {(thing, predicate): place for thing in things for predicate in predicates}
    return needed


def _once(findings: Iterable[Finding]) -> Iterable[Finding]:
    """Findings without those that an earlier step has already, which gets the numbers of all the
    steps; a state is that of its own step.

    A name is unknown but once, though what is near it depends on what the step wants there.
    """
    alike: dict[tuple[str, str, str, int | None], list[Finding]] = {}
    for finding in findings:
        step = finding.step if finding.code in _OF_ITS_STEP else None
        message = finding.message if finding.code not in _OF_A_NAME else ""
        alike.setdefault((finding.code, finding.subject, message, step), []).append(finding)
    for first, *others in alike.values():
        places = dict.fromkeys(each.step for each in (first, *others) if each.step is not None)
        yield replace(first, steps=tuple(places))


def _pointless(sound: Sound, later: Iterable[Call], simulation: Simulation, scene: Scene) -> str:
    """Why a step is not needed: what it is for holds already, or what it moves need not move."""
    if sound.ground is not None:
        return _left_there(sound.ground, simulation, scene) or _served(sound.ground, scene)
    action = sound.action
    if action is None or not (action.fetches or action.purpose) or not sound.call.args:
        return ""
    moved = set(scene.kg.find(sound.call.args[0]))
    text = "; ".join(finding.message for finding in sound.findings)
    if not moved or any(finding.code not in _OF_MOVING for finding in sound.findings):
        return ""
    if action.purpose and not action.fetches and moved & simulation.left_there:
        return f"{text}, so it stays where it is"
    why = f"{text}, and no later step moves it"
    for call in later:
        named = [bool(moved & set(scene.kg.find(arg))) for arg in call.args]
        if not any(named[:1] if action.fetches else named):
            if any(named) and not why:
                why = f"{text}, and it is used where it stands"
            continue
        needless = _needless(text, understand(call, scene).ground, scene)
        known = resolve.action(call.action, scene).action
        if needless or known is None or not (known.fetches or known.purpose):
            return needless  # it does more than to move the thing
        why = ""  # it was to be somewhere else, unless it is used all the same
    return why if action.fetches else ""


def _left_there(ground: GroundAction, simulation: Simulation, scene: Scene) -> str:
    """Why something is not put down: it could not be picked up, and need not be."""
    thing = next(iter(ground.values.values()), None)
    if ground.action.purpose is None or thing not in simulation.left_there:
        return ""
    if all_hold(complete(ground, scene.kg), scene.kg):
        return ""
    return f"{scene.kg.name(thing)} stays where it is"


def _needless(text: str, following: GroundAction | None, scene: Scene) -> str:
    """Why what cannot be moved need not be: the step that follows can be done without."""
    if following is None:
        return ""
    served = _served(following, scene)
    following = complete(following, scene.kg)
    if served:
        return f"{text}, and {served}"
    if all_hold(following, scene.kg):
        return f"{text}, and {following.action.name} does not need it"
    return ""


def _served(ground: GroundAction, scene: Scene) -> str:
    """The sentence of an action's purpose, if it holds before the action is done."""
    purpose = ground.action.purpose
    if purpose is None:
        return ""
    ground = complete(ground, scene.kg)
    return sentence(purpose.message, ground, scene.kg) if holds(purpose, ground, scene.kg) else ""


def _spoilers(scene: Scene) -> set[tuple[int, Node]]:
    """What already spoils a result before the plan: not the plan's fault."""
    return {
        (n, row["item"])
        for n, goal in enumerate(scene.domain.advice)
        for row in scene.kg.rows(goal.query, {})
        if "item" in row
    }


def _put_right(simulation: Simulation, before: set[tuple[int, Node]], scene: Scene) -> None:
    """Undo at the end what the plan leaves in the wrong state, or warn of it.

    A goal that is met is not given up for that.
    """
    goals = [
        (aim(scene.kg, goal.query, {}), goal.message)
        for goal in (*scene.domain.goals, *scene.task.goals)
        if not goal.classes and scene.kg.ask(goal.query, {"agent": scene.domain.agent})
    ]
    for n, node in sorted(_spoilers(scene) - before):
        goal = scene.domain.advice[n]
        message = goal.message.format(item=scene.kg.name(node))
        right = Aim(
            lambda n=n, node=node: (n, node) not in _spoilers(scene),  # type: ignore[misc]
            mentions(goal.query),
            {"item": node},
        )
        if not simulation.achieve([(right, message), *goals]):
            simulation.findings.append(Finding("W601", message, scene.kg.name(node)))


def _reach_goals(simulation: Simulation, scene: Scene) -> None:
    """Add the steps that bring a goal about, where the domain says what they may be about.

    What brings one about may undo another, which is brought about again then.
    """
    agent = {"agent": scene.domain.agent}
    goals = [goal for goal in (*scene.domain.goals, *scene.task.goals) if goal.about]
    for _ in range(_ROUNDS):
        count = len(simulation.steps)
        for goal in goals:
            if simulation.tainted or scene.kg.ask(goal.query, agent):
                continue
            for row in scene.kg.rows(goal.about, agent)[:MOST_ROWS]:
                if simulation.achieve([(aim(scene.kg, goal.query, agent, row), goal.message)]):
                    break
        if len(simulation.steps) == count:
            break


def _unused(grounded: Sequence[GroundAction | None], parsed: Parsed, scene: Scene) -> list[Finding]:
    """Findings for the required items that no step of the plan names."""
    entities = {value for ground in grounded if ground for value in ground.values.values()}
    written = {normal(arg) for w in parsed.calls for arg in w.call.args}
    findings = []
    for name in scene.task.required:
        meant = set(scene.kg.find(name))
        if not parsed.calls or meant & (entities | scene.done) or normal(name) in written:
            continue
        message = f"the task requires {name}, which no step of the plan uses"
        if not meant and not is_absent(scene.kg, name, "item"):
            message = f"the task requires {name}, which is not in the knowledge graph"
        findings.append(Finding("E501" if meant else "E201", message, name))
    return findings


def lost_items(old: Parsed, new: Parsed, scene: Scene) -> tuple[str, ...]:
    """Return the required items that an earlier plan names and a new one no longer does.

    A word for several items names them all, and one with a state names its item; an item
    known to be absent cannot be lost.
    """

    def named(parsed: Parsed, name: str) -> bool:
        meant = set(scene.kg.find(name))
        args = {arg for w in parsed.calls for arg in w.call.args}
        return bool(meant & scene.done) or any(
            set(words(name)) <= set(words(arg))
            or meant & set(scene.kg.find(arg))
            or normal(arg) in scene.domain.quantifiers
            for arg in args
        )

    wanted = [name for name in scene.task.required if not is_absent(scene.kg, name, "item")]
    return tuple(name for name in wanted if named(old, name) and not named(new, name))
