"""The dialogue with the person: readings and goals to confirm, questions, offers, contradictions,
changes of the plan, the review (paper, III-C)."""

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

from adaptbot_cli.core.acts import rest
from adaptbot_cli.core.ask import agenda, suggest, teach
from adaptbot_cli.core.ask.amend import amended, unsolved
from adaptbot_cli.core.ask.learning import Lesson, alias, attribute_question
from adaptbot_cli.core.ask.questions import (
    EDIT,
    KNOWN,
    LATER,
    NEW,
    NO,
    SAME,
    STOP,
    YES,
    Answer,
    Choice,
    Names,
    Question,
    Reviewed,
    Suggestion,
)
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.names import nearest, normal, sentence_list
from adaptbot_cli.core.plan import KeptPlan
from adaptbot_cli.core.refine.mend import Mended, mended
from adaptbot_cli.core.report import Outcome, Report
from adaptbot_cli.core.request.understand import Reading
from adaptbot_cli.core.run import Plans, Run, as_edited, look_at, refuted_last, retract_all
from adaptbot_cli.core.turns import (
    Ask,
    Checked,
    Keep,
    Kept,
    Learned,
    LookUp,
    Offer,
    Review,
    Trace,
    Turn,
)


def ask(run: Run, report: Report, required_only: bool = False) -> Generator[Turn, Any, Report]:
    """Ask the person about what is open, learn from each answer, and check again (III-C).

    What is to be known of one thing is asked together; once nothing needs more of a new thing, the
    rest of what its kind is asked is offered.
    """
    shown = True
    while True:
        question = None
        if not run.stopped:
            question = agenda.next_question(
                report,
                run.scene,
                run.asked,
                required_only,
                doubt=run.policy == "tutor" and not required_only,
            )
        known = len(run.lessons)
        name = agenda.unoffered(run.asked, run.offers, question)
        if name is not None and not run.stopped:
            run.offers.add(name)
            yield from _offer(run, report, agenda.rest(name, run.scene, run.asked))
        elif question is not None:
            if not shown and question.about not in agenda.taught(run.asked):
                yield Checked(report)
                shown = True
            yield from _ask_together(run, report, question)
            if run.to_edit:
                run.to_edit, shown = False, True
                report = yield from amended(run, report, "asked")
        else:
            break
        if len(run.lessons) > known:
            report = yield from look_at(run, report.text, show=False)
            shown = False
    if not shown:
        yield Checked(report)
    return report


def ask_about(run: Run, report: Report, question: Question) -> Generator[Turn, Any, Report]:
    """Ask one question, and what else is to be known of the same thing because of the answer."""
    following: Question | None = question
    while following is not None and not run.stopped:
        known = len(run.lessons)
        yield from _ask_together(run, report, following)
        if len(run.lessons) > known:
            report = yield from look_at(run, report.text, show=False)
        following = agenda.following(question.about, report, run.scene, run.asked)
    return report


def _ask_together(run: Run, report: Report, question: Question) -> Generator[Turn, Any, None]:
    """Ask a question, and what else is to be known of the same thing."""
    yield from _look_around(run, question)
    seen = tuple(f"seen: {sentence}" for sentence in run.seen(3, question.about))
    form = agenda.around(question, report, run.scene, run.asked, run.full)
    rest: tuple[Question, ...] = ()
    if question.about in agenda.taught(run.asked) and question.about not in run.offers:
        rest = agenda.rest(question.about, run.scene, run.asked, form)
    for n, each in enumerate(form):
        doubted = teach.doubted(each, run.scene)
        if run.stopped or (n and doubted):
            continue
        answered = run.answered
        notes = each.notes if n else (*each.notes, *seen)
        if doubted:
            notes = (*notes, *(yield from _as_known(run, doubted)))
            if each.kind == "attribute":  # who is not sure leaves it as it is
                known = YES if teach.is_so(each, run.scene) else NO
                each = replace(each, suggested=Suggestion(known, "as it is known"))
        together = form[n + 1 :]
        ready = replace(
            refuted_last(run, each),
            notes=notes,
            together=together,
            offered=rest,
            answered=answered,
        )
        answer: Answer = yield Ask(ready)
        if answer.value == EDIT:
            run.to_edit = True
            return
        yield from _learn(run, report, each, answer, doubted)


def _as_known(run: Run, facts: tuple[Triple, ...]) -> Generator[Turn, Any, list[str]]:
    """Format what is known of a question in doubt, with its origin."""
    origins = yield Trace(tuple(teach.short(fact) for fact in facts))
    return [
        f"{KNOWN}: {teach.in_words(fact, run.kg)}{f' ({origin})' if origin else ''}"
        for fact, origin in zip(facts, [*(origins or ()), *[""] * len(facts)], strict=False)
    ]


def _offer(run: Run, report: Report, questions: tuple[Question, ...]) -> Generator[Turn, Any, None]:
    """Offer further questions about a thing, all at once."""
    if not questions:
        return
    answered = run.answered
    ready = tuple(replace(question, answered=answered) for question in questions)
    answers: tuple[Answer, ...] = yield Offer(ready)
    run.stopped = any(answer.last for answer in answers)
    for question, answer in zip(questions, answers, strict=True):
        if answer.value != LATER.value and agenda.is_open(question, run.scene):
            yield from _learn(run, report, question, answer)


def _look_around(run: Run, question: Question) -> Generator[Turn, Any, None]:
    """Look up the words for what is known, which the answer to a question is likely to be like."""
    words = suggest.words_to_look_up(question, run.scene)
    if words:
        found = yield LookUp(words, run.kg.domain.noun_fields)
        run.scene.around.update({word: found.get(word, ()) for word in words})


def _learn(
    run: Run,
    report: Report,
    question: Question,
    answer: Answer,
    doubted: tuple[Triple, ...] = (),
) -> Generator[Turn, Any, None]:
    """Learn from an answer; what it was asked in doubt of needs no more asking to be corrected."""
    answer = run.take(question, answer)
    for lesson in teach.lessons(question, answer, report, run.scene, run.asked):
        if doubted:
            agreed = teach.corrected(lesson, doubted, run.scene)
        else:
            agreed = yield from _settle(run, lesson)
        if agreed is not None:
            teach.accept(agreed, run.scene)
            run.lessons.append(agreed)
            yield Learned(agreed)


def _settle(run: Run, lesson: Lesson) -> Generator[Turn, Any, Lesson | None]:
    """Have the person say what stands if a lesson contradicts what is known."""
    old = teach.contradicted(lesson, run.scene)
    if not old:
        return lesson
    reply = yield Trace(tuple(teach.short(fact) for fact in old))
    question = teach.which_stands(lesson, old, reply or (), run.lessons, run.scene)
    ready = replace(question, answered=run.answered)
    answer: Answer = LATER if run.stopped else (yield Ask(ready))
    if answer.value == STOP.value:
        run.stopped, answer = True, LATER
    run.asked[question.key] = (question, answer)
    return teach.settled(lesson, old) if answer.value == NEW else None


def keep(run: Run) -> Generator[Turn, Any, bool]:
    """Have the person review what was learned, then have what is accepted committed.

    Return whether something was left out, so that the plan must be judged again.
    """
    run.once += [lesson for lesson in run.lessons if lesson.once]
    run.lessons = [lesson for lesson in run.lessons if not lesson.once]
    if not run.lessons:
        return False
    reviewed: bool | Reviewed = yield Review(tuple(run.lessons))
    keys = {lesson.question.key for lesson in run.lessons}
    if isinstance(reviewed, Reviewed):
        # Once the robot has begun to act, who goes back is asked again instead.
        run.went_back = reviewed.back is not None
        keys &= reviewed.left_out | ({reviewed.back} if reviewed.back else set())
        for key in keys if reviewed.back else ():
            run.asked.pop(key, None)
    left_out = set(teach.resting_on(keys, run.lessons)) if reviewed is not True else set()
    accepted = [lesson for lesson in run.lessons if lesson.question.key not in left_out]
    if left_out:
        once = run.once
        retract_all(run)
        for lesson in (*once, *accepted):
            teach.accept(lesson, run.scene)
        run.lessons, run.once = accepted, once
    if not accepted:
        return True
    kept: Kept = yield Keep(run.task, tuple(accepted))
    run.kept += accepted
    run.lessons = []
    run.revision = kept.revision or run.revision
    return bool(left_out)


CHANGED, MET = "changed by hand", "met its goal in the world"
"""Why a plan is offered to be kept."""


def keep_plan(
    run: Run, report: Report, outcome: Outcome | None, plans: Plans
) -> Generator[Turn, Any, None]:
    """Offer to keep a plan for its task that the person has changed, or that one of a model's has
    met its goal with in the world, unless it is the one that is kept already; have it kept."""
    agreed = (q.kind == "mend" and answer.value == YES for q, answer in run.asked.values())
    why = CHANGED if run.edits or any(agreed) else MET if plans == "any" and run.acting else ""
    done = outcome is not None and not outcome.error and not outcome.unmet
    text = rest(step for step in report.steps if step.done in (None, "done"))
    if not (why and done and report.executable) or text == run.recalled or run.stopped:
        return
    question = Question(
        "plan",
        normal(run.task.name),
        f'Shall I keep this plan for "{run.task.name}"?',
        why,
        choices=(
            Choice(YES, "yes", "it comes first from now on", "y"),
            Choice(NO, "no", key="n"),
        ),
    )
    answer: Answer = yield Ask(question)
    if run.take(question, answer).value == YES:
        sentence = f'the plan for "{run.task.name}" is kept ({len(text.splitlines())} steps)'
        lesson = Lesson(Delta(), question, answer, sentence, plan=KeptPlan(run.task, text))
        kept: Kept = yield Keep(run.task, (lesson,))
        run.kept.append(lesson)
        run.revision = kept.revision or run.revision


_CHOICES = (
    Choice(YES, "yes, change it", key="y"),
    Choice(NO, "no, leave it as it is", key="n"),
    Choice(EDIT, "let me change it myself", key="e"),
)


def mend(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """Offer the changes that bring a plan nearer to its goal, each once; make them if agreed to.

    What they need and nobody has said is asked first, and so is what an edit instead of them brings
    up. The paper's policy offers nothing.
    """
    if run.policy == "paper" or run.stopped or not unsolved(run, report):
        return report
    offered = mended(report, run.scene, run.parse)
    if offered is not None and offered.supposed:
        for question in _unknown(run, offered):
            report = yield from ask_about(run, report, question)
        offered = None if run.stopped else mended(report, run.scene, run.parse)
    if offered is None or offered.supposed:
        return report
    return (yield from _offer_change(run, report, offered))


def _unknown(run: Run, offered: Mended) -> list[Question]:
    """The questions that nobody has been asked for what an offer supposes."""
    kg = run.kg
    found = [
        attribute_question(kg, normal(kg.name(entity)), kg.domain.properties[prop], "")  # type: ignore[index]
        for entity, prop, _ in offered.supposed
        if prop in kg.domain.properties
    ]
    return [question for question in found if question.key not in run.asked]


def _offer_change(run: Run, report: Report, offered: Mended) -> Generator[Turn, Any, Report]:
    then = "Then it reaches its goal." if offered.reaches else "Then it is nearer to its goal."
    question = Question(
        "mend",
        normal(run.task.name),
        f"Shall I change the plan like this? {then}",
        offered.text,  # who agreed to one plan has not agreed to another
        choices=_CHOICES,
        notes=offered.changes,
    )
    if question.key in run.asked:
        return report
    answer: Answer = yield Ask(replace(question, answered=run.answered))
    if answer.value == EDIT:
        edited = yield from amended(run, report, "asked")
        return report if edited is report else (yield from ask(run, edited))
    if run.take(question, answer).value != YES:
        return report
    return (yield from look_at(run, as_edited(run, offered.text)))


Asked = list[tuple[Question, Answer]]

_MOST_NAMES = 100


def confirmed(
    text: str, read: Callable[[str], Reading]
) -> Generator[Turn, Any, tuple[Reading, Asked]]:
    """Read a request; have the person confirm the reading if something in it is in doubt.

    Another task can be named instead: what the request excludes holds for that one too. Whoever
    says that the reading is wrong is taken at their word: nothing is done.
    """
    reading = read(text)
    if not reading.doubts:
        return reading, []
    names = [name.replace("_", " ") for name in reading.names]
    question = Question(
        "reading",
        normal(text),
        f"Do you mean this: {reading.meant}?",
        choices=(
            Choice(YES, "yes, that is all I mean", key="y"),
            Choice(SAME, "no, another task", key="a"),
            Choice(NO, "no, do nothing", key="n"),
            Choice(LATER.value, "ask me later", "the goal stays open", "l"),
        ),
        known=Names(nearest(text, names, _MOST_NAMES, floor=0.0)),
        notes=reading.doubts,
    )
    answer: Answer = yield Ask(question)
    asked = [(question, answer)]
    if answer.value == YES:
        return reading.confirmed(), asked
    if answer.value == NO:
        return replace(reading, tasks=(), refused=reading.meant), asked
    if answer.same_as:
        return _instead(reading, read(answer.same_as)), asked
    return reading, asked


def _instead(reading: Reading, other: Reading) -> Reading:
    """Another task in place of the one that was read, with all that was excluded."""
    first, others = reading.tasks[:1], reading.tasks[1:]
    tasks = list(other.tasks)
    for old in first:
        for n, task in enumerate(tasks):
            out = {
                "excluded": tuple(dict.fromkeys((*old.excluded, *task.excluded))),
                "barred": old.barred | task.barred,
                "rules": tuple(dict.fromkeys((*old.rules, *task.rules))),
                "refused": tuple(dict.fromkeys((*old.refused, *task.refused))),
                "amount": max(old.amount, task.amount),
            }
            kept = tuple(name for name in task.required if normal(name) not in old.barred)
            tasks[n] = replace(task, required=kept, **out)  # type: ignore[arg-type]
    return replace(reading, tasks=(*tasks, *others)).confirmed()


def judged(run: Run) -> Generator[Turn, Any, None]:
    """Have the person say by what goal a task is judged that none is known for, and keep that.

    What is offered are the goals of a class of tasks that word knowledge relates it to.
    """
    task = run.task
    likely = [run.kg.domain.task_classes[name] for name in task.like]
    if not task.thin or not likely:
        return
    other = likely[0]
    needs = tuple(goal.message.replace("{item}", "something") for goal in other.goals)
    question = Question(
        "goal",
        normal(task.name),
        f'I know no goal for "{task.name}". Shall I judge it as I judge {other.name}?',
        choices=(
            Choice(YES, f"yes, as {other.name}", "I remember it", "y"),
            Choice(NO, "no", "the goal stays unknown", "n"),
            Choice(LATER.value, "ask me later", key="l"),
        ),
        notes=(f"{other.name} fails where {sentence_list(needs)}",),
    )
    answer: Answer = yield Ask(replace(question, answered=tuple(run.asked.values())))
    answer = run.take(question, answer)
    if answer.value == YES and other.iri is not None:
        lesson = Lesson(
            alias(task.name, other.iri),
            question,
            answer,
            f"{task.name} is judged as {other.name}",
        )
        teach.accept(lesson, run.scene)
        run.lessons.append(lesson)
        yield Learned(lesson)
        run.task = run.scene.task = replace(
            task, goals=other.goals, iri=other.iri, judged_by=other.name, thin=False
        )
