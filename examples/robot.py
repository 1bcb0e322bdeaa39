"""A world for adaptbot: a robot that does what it is told, and refuses a step once if asked to.

    adaptbot run "make tea" --world 'exec:python examples/robot.py'
    adaptbot run "make tea" --world 'exec:python examples/robot.py switch'

It speaks the protocol of docs/worlds.md, one JSON object a line, and needs nothing but Python. A
real robot would move where this one only says that it has.
"""

import json
import sys
from typing import Any


class Robot:
    """Answers messages. `clumsy` are the actions that fail once."""

    def __init__(self, clumsy: set[str]) -> None:
        self.clumsy = clumsy
        self.able: set[str] = set()

    def answer(self, said: dict[str, Any]) -> dict[str, Any]:
        """Return what to say to one message."""
        if "hello" in said:
            self.able = {action["name"] for action in said["actions"]}
            return {"ready": True, "observed": []}
        if "stop" in said:
            return {"stopped": True}
        number, action = said["act"], said["action"]
        if action not in self.able:
            return {"failed": number, "reason": f"I have never learned to {action}"}
        if action in self.clumsy:
            self.clumsy.remove(action)
            return {"failed": number, "reason": "my hand slipped"}
        # Here the robot would act. What it then sees may differ from what was expected: say it.
        expected = said["expects"]
        return {"done": number, "observed": expected["added"], "gone": expected["removed"]}


def main() -> None:
    """Answer each line with a line, until the end."""
    robot = Robot(set(sys.argv[1:]))
    for line in sys.stdin:
        said = json.loads(line)
        sys.stdout.write(json.dumps(robot.answer(said)) + "\n")
        sys.stdout.flush()
        if "stop" in said:
            return


if __name__ == "__main__":
    main()
