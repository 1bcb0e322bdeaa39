"""The paper's baseline: a model alone, its plan carried out as it is written (IV-A2, "LLM")."""

from collections.abc import Generator, Iterator

from adaptbot_cli.core.findings import blocks
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Change, Finding, Parsed, Step, Task, Written
from adaptbot_cli.core.refine.expand import expand
from adaptbot_cli.core.refine.goals import check_goal
from adaptbot_cli.core.refine.grounding import in_order, understand
from adaptbot_cli.core.refine.simulation import Simulation
from adaptbot_cli.core.report import Outcome, Report, Result
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.core.tutor import Parse
from adaptbot_cli.core.usage import Usage

Proposals = Generator[Propose, Proposal, Result]


def unaided(task: Task, kg: Kg, parse: Parse, replans: int = 3) -> Proposals:
    """Carry out a model's plan as written; on an error prompt again, `replans` times at most.

    Nothing is refined: a name that only a remedy would make sense of is an error. What the paper's
    simulator does by itself, such as fetching what a step needs, happens here too.
    """
    usage, tries = Usage(), 0
    turn = Propose(task)
    while True:
        proposal = yield turn
        usage += proposal.usage
        report, outcome = _carry_out(parse(proposal.text), proposal.text, Scene(kg, task))
        if outcome.error is None or tries >= replans:
            break
        tries += 1
        turn = Propose(task, tries, proposal.text, (outcome.error,))
    size = kg.size()
    return Result(report, outcome, usage, sizes=(size, size))


def _carry_out(parsed: Parsed, text: str, scene: Scene) -> tuple[Report, Outcome]:
    """Take the steps in order up to the first error; then check the goal, if there was none."""
    parsed = in_order(parsed, scene)
    scene.notice([written.call for written in parsed.calls])
    simulation = Simulation(scene.kg)
    unmet: tuple[Finding, ...] = ()
    missing: tuple[str, ...] = ()
    with scene.kg.rehearsal():
        error = next(_blocking(parsed.findings), None) or _first_error(parsed, simulation, scene)
        if error is None:
            unmet, missing = check_goal(scene)
    errors = (error,) if error else ()
    left_out = _left_out(parsed, scene)
    findings = tuple(dict.fromkeys((*parsed.findings, *errors, *left_out, *unmet)))
    report = Report(
        task=scene.task,
        text=text,
        steps=tuple(simulation.steps),
        findings=findings,
        grounded=tuple(simulation.grounded),
        deltas=tuple(simulation.deltas),
        missing=tuple(dict.fromkeys((*(f.subject for f in left_out), *missing))),
    )
    return report, Outcome(tuple(simulation.deltas), error, unmet, missing)


def _blocking(findings: tuple[Finding, ...]) -> Iterator[Finding]:
    return (finding for finding in findings if blocks(finding))


def _first_error(parsed: Parsed, simulation: Simulation, scene: Scene) -> Finding | None:
    for place, written in enumerate(parsed.calls):
        error = _step(written, simulation, scene)
        if error is not None:
            _not_reached(parsed.calls[place + 1 :], simulation)
            return error
    return None


def _not_reached(calls: tuple[Written, ...], simulation: Simulation) -> None:
    for written in calls:
        simulation.steps.append(Step(written.call, written.source, written.line, "finding"))
        simulation.grounded.append(None)
        simulation.deltas.append(Delta())


def _step(written: Written, simulation: Simulation, scene: Scene) -> Finding | None:
    """Take one step as written, or return why it cannot be done."""
    meant = expand(written.call, scene)
    sound = understand(written.call, scene)
    change = meant.change or next(iter(sound.changes), None)
    number = len(simulation.steps) + 1
    if change is not None or not meant.calls:
        error = _not_as_written(change, written, number)
        _not_reached((written,), simulation)
        return error
    seen = len(simulation.findings)
    simulation.take(written, sound)
    return next(_blocking(tuple(simulation.findings[seen:])), None)


def _not_as_written(change: Change | None, written: Written, number: int) -> Finding:
    name = change.source if change is not None else written.call.render()
    code = "E101" if normal(name) == normal(written.call.action) else "E201"
    message = f"{name} cannot be carried out as it is written"
    return Finding(code, message, name, number, line=written.line, column=written.column)


def _left_out(parsed: Parsed, scene: Scene) -> list[Finding]:
    """Findings for the required items that the plan never names."""
    written = {normal(arg) for w in parsed.calls for arg in w.call.args}
    known = {entity for arg in written for entity in scene.kg.find(arg)}
    return [
        Finding("E501", f"the task requires {name}, which no step of the plan uses", name)
        for name in scene.task.required
        if normal(name) not in written and not known & set(scene.kg.find(name))
    ]
