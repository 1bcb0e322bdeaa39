"""A world behind a process that speaks JSON lines on its standard streams (docs/worlds.md)."""

import json
import os
import queue
import shlex
import shutil
import signal
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import IO, Any

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES, Triple
from adaptbot_cli.core.turns import Act, Begin, Stop
from adaptbot_cli.core.world import LOST, Seen, fact_of, named, plain, possible
from adaptbot_cli.errors import WorldError

VERSION = 1
"""The version of the protocol, sent in the first message."""

LONGEST_LINE, MOST_LINES, MOST_FACTS = 1_000_000, 1_000, 10_000
"""How many characters a line may have, how many lines may come while one step is awaited, and how
many facts an answer may have: what is beyond is nonsense, and no reason to run out of memory."""

MOST_ODD, LONGEST_TEXT = 5, 500
"""How many oddities of one answer are reported, and how many characters of a reason."""

LAST_SECONDS = 2.0
"""How many seconds the process has to send its last observation, and to end."""

Json = Mapping[str, Any]


@dataclass(slots=True)
class Process:
    """A world behind a process. `seconds` is how long it may take for one step.

    Nothing that it does is an error of this program: too late, dead or nonsense is a failed step.
    `answered` is whether the last message had an answer, `ended_by_itself` whether it ended so.
    """

    command: str
    kg: Kg
    seconds: float = 60.0
    _process: "subprocess.Popen[bytes] | None" = field(default=None, init=False)
    _lines: "queue.Queue[bytes | None]" = field(
        default_factory=lambda: queue.Queue(MOST_LINES), init=False
    )
    _readers: list[threading.Thread] = field(default_factory=list, init=False)
    _errors: list[bytes] = field(default_factory=list, init=False)
    _lost: str = field(default="", init=False)
    _over: bool = field(default=False, init=False)
    _awaited: tuple[int, tuple[str, Json]] | None = field(default=None, init=False)
    answered: bool = field(default=False, init=False)
    ended_by_itself: bool = field(default=True, init=False)

    @property
    def name(self) -> str:
        """How the world is called on the screen and in a transcript."""
        return f"exec:{self.command}"

    def find(self) -> list[str]:
        """Return the words of the command.

        Raises:
            WorldError: it cannot be read, or there is no such program.
        """
        try:
            words = shlex.split(self.command)
        except ValueError as error:
            raise WorldError(f"{self.name} cannot be read as a command: {error}") from error
        if not words:
            raise WorldError("exec: needs a command, as in --world 'exec:python robot.py'")
        if shutil.which(words[0]) is None:
            raise WorldError(f'{self.name}: there is no program "{words[0]}"')
        return words

    def begin(self, turn: Begin) -> Seen:
        """Start the process and greet it; each task has a process of its own, as `stop` ends it.

        Raises:
            WorldError: it cannot be started, or does not answer as the protocol has it.
        """
        self.close()
        self._start()
        domain = self.kg.domain
        hello = {
            "hello": VERSION,
            "domain": domain.name,
            **({"robot": domain.robot} if domain.robot else {}),
            "task": turn.task.said or turn.task.name,
            "actions": [
                {"name": action.name, "parameters": [p.name for p in action.parameters]}
                for action in domain.actions.values()
            ],
        }
        answer, odd = self._asked(hello, lambda reply: "ready" in reply)
        if answer is None or answer.get("ready") is not True:
            why = self._lost or "it did not say that it is ready"
            self.close()
            again = shlex.quote(self.name)
            raise WorldError(
                f"{self.name}: {why}{self._last_words()}; see adaptbot world check {again}"
            )
        return self._seen(answer, Delta(), odd)

    def act(self, turn: Act) -> Seen:
        """Have a step carried out; return what came of it.

        A step that was not answered is first waited for once more, before it is sent again: its
        robot may still be at it.
        """
        name, values = turn.ground.action.name, turn.ground.values
        given = [p.name for p in turn.ground.action.parameters if p.name in values]
        arguments = {key: plain(values[key], self.kg) for key in given}
        step = (name, arguments)
        awaited = self._awaited is not None and self._awaited[1] == step
        number = self._awaited[0] if awaited and self._awaited else turn.number
        message = {
            "act": number,
            "action": name,
            "args": [*arguments.values()],
            "arguments": arguments,
            "expects": {
                "added": [named(fact, self.kg) for fact in sorted(turn.expected.added)],
                "removed": [named(fact, self.kg) for fact in sorted(turn.expected.removed)],
            },
        }
        sent = None if awaited else message
        answer, odd = self._asked(sent, lambda reply: _is_answer(reply, number))
        late = not (answer or awaited or self._over)
        self._awaited = (number, step) if late else None
        if answer is None:
            words = self._last_words() if self._over else ""
            return Seen(f"{self._lost}{words}", odd=odd, over=LOST if self._over else "")
        failed = answer.get("failed") is not None
        seen = self._seen(answer, Delta() if failed else turn.expected, odd)
        reason = _text(answer.get("reason") or "it did not say why") if failed else ""
        return replace(seen, failed=reason)

    def stop(self, turn: Stop) -> Seen:
        """Tell the process that nothing more is to be done; hear what it sees at the end, if it
        says so, and whether the goal is met."""
        if not self._alive():
            return Seen()
        before, self.seconds = self.seconds, min(self.seconds, LAST_SECONDS)
        answer, odd = self._asked({"stop": turn.why}, lambda reply: "stopped" in reply)
        self.seconds = before
        if answer is None:
            return Seen(odd=odd)
        goal = answer.get("goal")
        seen = self._seen(answer, Delta(), odd)
        why = _text(answer.get("reason") or "")
        if not isinstance(goal, bool | None):
            goal, why = False, f"its goal is neither true nor false: {_text(json.dumps(goal))}"
        return replace(seen, failed=why, goal=goal)

    def close(self) -> None:
        """End the process and what it has started."""
        process = self._process
        if process is None:
            return
        with suppress(OSError):
            if process.stdin:
                process.stdin.close()
        try:
            process.wait(LAST_SECONDS)
        except subprocess.TimeoutExpired:
            self.ended_by_itself = False
        for number in (signal.SIGTERM, signal.SIGKILL):
            if _is_gone(process, number):
                break
        for reader, stream in zip(self._readers, (process.stdout, process.stderr), strict=True):
            reader.join(LAST_SECONDS / 2)
            if stream and not reader.is_alive():  # else a stranger holds the other end
                stream.close()
        self._process = None

    def _start(self) -> None:
        words = self.find()
        try:
            self._lines, self._readers, self._errors = queue.Queue(MOST_LINES), [], []
            self._lost, self._over, self.ended_by_itself = "", False, True
            self._awaited = None
            self._process = subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,  # Ctrl-C is for this program: the step at hand is finished
            )
        except OSError as error:
            raise WorldError(f"{self.name} cannot be started: {error.strerror}") from error
        for stream, take in (
            (self._process.stdout, self._lines.put),
            (self._process.stderr, self._note_error),
        ):
            reader = threading.Thread(target=_read, args=(stream, take), daemon=True)
            reader.start()
            self._readers.append(reader)

    def _note_error(self, line: bytes | None) -> None:
        if line:
            self._errors[:] = [*self._errors[-4:], line[:500]]

    def _alive(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def _last_words(self) -> str:
        """What the process last wrote on its standard error."""
        lines = b" ".join(self._errors[-2:]).decode("utf-8", "replace").split()
        return f' (it wrote: "{" ".join(lines)[:300]}")' if lines else ""

    def _asked(self, message: Json | None, fits: Any) -> tuple[Json | None, tuple[str, ...]]:
        """Send a message, if there is one, and wait for the answer; None if none comes, and `_lost`
        has the reason."""
        assert self._process is not None and self._process.stdin is not None
        odd = [_unfit(line) for line in self._unasked()] if message else []
        self.answered = False
        try:
            if message:
                self._process.stdin.write(json.dumps(message).encode() + b"\n")
                self._process.stdin.flush()
        except (OSError, ValueError):
            self._end("it no longer listens")
            return None, ()
        until = time.monotonic() + self.seconds
        for _ in range(MOST_LINES):
            try:
                line = self._lines.get(timeout=max(0.0, until - time.monotonic()))
            except queue.Empty:
                self._lost = f"it did not answer within {self.seconds:g} seconds"
                self._over = not self._alive()
                break
            if line is None:
                self._end("it has closed its output")
                break
            record = _object(line)
            if record is not None and fits(record):
                self.answered = True
                return record, tuple(odd[:MOST_ODD])
            odd.append(_unfit(line))
        else:
            self._lost, self._over = "its answers never end", True
        return None, tuple(odd[:MOST_ODD])

    def _unasked(self) -> Iterator[bytes]:
        """The lines that have come since the last answer: they cannot be one to what comes next."""
        with suppress(queue.Empty):
            for _ in range(MOST_LINES):
                line = self._lines.get_nowait()
                if line is None:
                    self._lines.put(None)
                    return
                yield line

    def _end(self, deaf: str) -> None:
        """Note that the process can no longer be asked: it has ended, or it lives and is `deaf`."""
        assert self._process is not None
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LAST_SECONDS)
        self._readers[-1].join(LAST_SECONDS)  # its last words may still be on the way
        code = self._process.poll()
        self._lost = deaf if code is None else f"the process has ended with code {code}"
        self._over = True

    def _seen(self, answer: Json, expected: Delta, odd: Iterable[str]) -> Seen:
        """What an answer reports beside what is expected; nonsense is left out and noted."""
        strange = list(odd)
        observed = self._facts(answer.get("observed"), strange)
        gone = self._facts(answer.get("gone"), strange)
        both, observed, gone = observed & gone, observed - gone, gone - observed
        several = _several(observed, self.kg)
        denied = {fact for fact in observed | gone if self.kg.home_of(fact[1]) != STATES}
        denied = {fact for fact in denied if (fact in self.kg.facts) != (fact in observed)}
        for text, facts in (
            ("it says of {} that it holds and that it does not", both),
            ("it says several values of {}", several),
            ("what a thing is like is for a person to say: {}", denied),
        ):
            names = (" ".join(map(str, named(fact, self.kg))) for fact in sorted(facts))
            strange += map(text.format, names)
        seen, wrong = possible(self.kg, expected, Seen("", observed - several, gone))
        strange += [f"it says what cannot be: {each}" for each in wrong]
        return replace(seen, odd=tuple(map(_text, strange[:MOST_ODD])))

    def _facts(self, value: object, strange: list[str]) -> frozenset[Triple]:
        if value is None:
            return frozenset()
        if not isinstance(value, list) or len(value) > MOST_FACTS:
            strange.append(f"it told facts that are no list of at most {MOST_FACTS}")
            return frozenset()
        found = set()
        for each in value:
            try:
                found.add(fact_of(each, self.kg))
            except ValueError as error:
                strange.append(str(error))
        return frozenset(found)


def _several(facts: frozenset[Triple], kg: Kg) -> frozenset[Triple]:
    """The facts that cannot all hold: several values of what has one."""
    single = {iri for iri, prop in kg.domain.properties.items() if prop.functional}
    tally = Counter(fact[:2] for fact in facts if fact[1] in single)
    return frozenset(fact for fact in facts if tally[fact[:2]] > 1)


def _is_gone(process: "subprocess.Popen[bytes]", number: int) -> bool:
    """Send a signal to a process and to what it has started; return whether they end soon."""
    until = time.monotonic() + LAST_SECONDS
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
        while time.monotonic() < until:
            process.poll()
            os.killpg(process.pid, 0)
            time.sleep(0.01)
        return False
    process.wait()
    return True


def _is_answer(record: Json, number: int) -> bool:
    """Whether a message is the outcome of a step, of this one alone."""
    found = [record[key] for key in ("done", "failed") if record.get(key) is not None]
    return bool(found) and all(n == number and not isinstance(n, bool) for n in found)


def _text(value: object) -> str:
    """The beginning of a value as text that can be written anywhere."""
    return str(value)[:LONGEST_TEXT].encode("utf-8", "replace").decode()


def _object(line: bytes) -> Json | None:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _unfit(line: bytes) -> str:
    what = "what is no JSON object" if _object(line) is None else "what was not asked for"
    return f"it said {what}: {line[:100].decode('utf-8', 'replace').strip()}"


def _read(stream: IO[bytes], take: Any) -> None:
    """Pass lines on as they come; None at the end. A line without end is given in parts."""
    with suppress(ValueError, OSError):
        while line := stream.readline(LONGEST_LINE):
            if line.strip():
                take(line)
    take(None)
