"""VirtualHome's simulator behind adaptbot's protocol of worlds (docs/worlds.md).

    adaptbot run "read book" --domain virtualhome --world 'exec:python bridge.py 1073_1'

It builds the scene of one of the package's tasks, has each step done by the package's own executor,
answers with its reason where that refuses, and lets its own judge decide at the end. The robot sees
the room in which it is, but not into what is closed; the answer tells what is not as it was told.

Disturbances, each once the robot has been greeted, and behind its back:

    --move novel=on:table_226 or inside:dresser_108     a thing lies somewhere else
    --set television=PLUGGED_OUT                        a thing is in another state

With `--log FILE` what came of it is written there: whether the goal is met, what is not so, the
steps that were done and those that were refused.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from scene import ROBOT, STATES, Fact, Task, World

OPPOSITE = {"OPEN": "CLOSED", "ON": "OFF", "PLUGGED_IN": "PLUGGED_OUT", "CLEAN": "DIRTY"}
OPPOSITE |= {other: state for state, other in OPPOSITE.items()}


class Bridge:
    """Answers messages. `told` is what the robot believes of the scene, as far as is known here."""

    def __init__(self, task: Task, moves: list[str], states: list[str]) -> None:
        self.task = task
        self.told = task.facts(task.graph)
        graph = json.loads(json.dumps(task.graph))
        for told in moves:
            moved(graph, task, *told.split("=", 1))
        for told in states:
            changed(graph, task, *told.split("=", 1))
        self.world = World(graph)
        self.refused: list[tuple[str, str]] = []

    def verdict(self) -> dict[str, Any]:
        """Return what has come of it, as the package's judge sees it."""
        unmet = self.task.unmet(self.world.graph, self.world.done)
        return {"unmet": unmet, "done": self.world.done, "refused": self.refused}

    def answer(self, said: dict[str, Any]) -> dict[str, Any]:
        """Return what to say to one message."""
        if "hello" in said:
            return {"ready": True}
        if "stop" in said:
            unmet = self.verdict()["unmet"]
            reason = {"reason": "; ".join(unmet)} if unmet else {}
            return {"stopped": True, "goal": not unmet, **reason}
        line, why = "", ""
        try:
            line = self.task.line(said["action"], said["args"])
            why = self.world.do(line)
        except KeyError as error:
            why = f"there is no {error.args[0]} here"
        if why:
            self.refused.append((line or said["action"], why))
        else:
            self.told -= {(s, p, o) for s, p, o in said["expects"]["removed"]}
            self.told |= {(s, p, o) for s, p, o in said["expects"]["added"]}
        answer = {"failed": said["act"], "reason": why} if why else {"done": said["act"]}
        return {**answer, **self.seen(set(said["args"]))}

    def seen(self, about: set[str]) -> dict[str, list[Fact]]:
        """Return what is not as the robot was told, of what it sees and what a step was about."""
        true = self.task.facts(self.world.graph)
        visible = self.visible() | about
        # What steps leave a note of (done_to, did) is the robot's own memory.
        told = {fact for fact in self.told if fact[1] not in ("done_to", "did")}
        observed = {fact for fact in true - told if fact[0] in visible}
        gone = {fact for fact in told - true if fact[0] in visible or self.misses(fact)}
        self.told = (self.told | observed) - gone
        return {"observed": sorted(observed, key=str), "gone": sorted(gone, key=str)}

    def visible(self) -> set[str]:
        """The things in the room where the robot is, but for what is inside something closed."""
        facts = self.task.facts(self.world.graph)
        rooms = {o for s, p, o in facts if s == "robot" and p == "in_room"}
        closed = {s for s, p, o in facts if p == "is_open" and o is False}
        hidden = {s for s, p, o in facts if p == "inside" and o in closed}
        here = {s for s, p, o in facts if p == "in_room" and o in rooms}
        return (here - hidden) | {"robot"}

    def misses(self, fact: Fact) -> bool:
        """Whether the robot sees the place where it was told that something is."""
        return fact[1] in ("on", "inside") and fact[2] in self.visible()


def moved(graph: dict[str, Any], task: Task, name: str, place: str) -> None:
    """Put a thing on or inside another one: all that said where it was is gone."""
    relation, target = place.split(":", 1)
    numbers = {known: number for number, known in task.names.items()}
    thing, there = numbers[name], numbers[target]
    rooms = [
        edge["to_id"]
        for edge in graph["edges"]
        if edge["from_id"] == there
        and edge["relation_type"] == "INSIDE"
        and task.known.get(edge["to_id"], {}).get("category") == "Rooms"
    ]
    graph["edges"] = [e for e in graph["edges"] if thing not in (e["from_id"], e["to_id"])]
    new = [(thing, relation.upper(), there), (thing, "CLOSE", there), (there, "CLOSE", thing)]
    new += [(thing, "INSIDE", room) for room in rooms]
    graph["edges"] += [{"from_id": a, "relation_type": r, "to_id": b} for a, r, b in new]


def changed(graph: dict[str, Any], task: Task, name: str, state: str) -> None:
    """Put a thing into a state, and out of the opposite one."""
    (node,) = (n for n in graph["nodes"] if task.names[n["id"]] == name and n["id"] != ROBOT)
    if state not in STATES:
        raise SystemExit(f"there is no state {state}; there is {', '.join(STATES)}")
    node["states"] = [s for s in node["states"] if s != OPPOSITE.get(state)] + [state]


def main() -> None:
    """Answer each line with a line, until the end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", help="the number of a task of the package, such as 1073_1")
    parser.add_argument("--move", action="append", default=[], metavar="THING=on:PLACE")
    parser.add_argument("--set", action="append", default=[], metavar="THING=STATE")
    parser.add_argument("--log", type=Path, metavar="FILE")
    given = parser.parse_args()
    bridge = Bridge(Task(given.task), given.move, given.set)
    for line in sys.stdin:
        said = json.loads(line)
        sys.stdout.write(json.dumps(bridge.answer(said)) + "\n")
        sys.stdout.flush()
        if given.log:
            given.log.write_text(json.dumps(bridge.verdict()))
        if "stop" in said:
            return


if __name__ == "__main__":
    main()
