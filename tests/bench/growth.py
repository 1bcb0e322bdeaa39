"""What each command costs on homes of 10^3 to 10^7 facts: processor time and memory of its process.

    python tests/bench/growth.py [--sizes 1000,10000,…] [--only NAME,…] [--results FILE]
                                 [--plot docs/growth.svg]

Each home is made from the bundled kitchen (`synthetic.grown`), committed in a workspace, and every
command is started on it as a process. The time beside it is of the engine's own bulk load of the
two files. A command that takes longer than `--patience` seconds is left out at larger sizes.
`--results` keeps what was measured, and adds to what is there.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import FACT_FILES, graph_of
from adaptbot_cli.resources import bundled
from adaptbot_cli.workspace import Workspace
from tests.bench.synthetic import FACTS_A_THING, PLAN, grown

Json = dict[str, Any]
ANSWERS = "leek: {existence: exists, kind: object, obj_location: fridge}\n"
COMMANDS = {
    "run": ["run", "make omelette", "--no-human"],
    "check": ["check", "PLAN", "--task", "make tea"],
    "kg show NAME": ["kg", "show", "egg"],
    "kg show a name that is not there": ["kg", "show", "eggg"],
    "kg show": ["kg", "show"],
    "kg stats": ["kg", "stats"],
    "kg query … LIMIT 1": ["kg", "query", "SELECT ?s WHERE { ?s ex:obj_name ?n } LIMIT 1"],
    "kg why NAME": ["kg", "why", "egg"],
    "kg add": ["kg", "add", "leek", "--answers", "ANSWERS", "--yes"],
    "kg diff": ["kg", "diff"],
    "kg validate": ["kg", "validate"],
    "kg import": ["kg", "import", "GIVEN", "--yes"],
}
LOAD = "the engine's raw load"
LARGE = 100_000
SPLIT, MADE = "kg split", "the copy on disk is made"
"""What is done first in a home of `LARGE` facts or more."""
WARM = ("kg why NAME", "kg show NAME", "check", "run")
"""What is run twice: the second time finds what the first has kept."""


def started(arguments: list[str], environment: dict[str, str], folder: Path) -> Json:
    """Run a process; return its processor time in seconds, its memory in MB and its exit code."""
    with (folder / "out.txt").open("wb") as out:
        process = subprocess.Popen(
            arguments, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=out
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return {
        "seconds": used.ru_utime + used.ru_stime,
        "megabytes": used.ru_maxrss / 1024,
        "code": process.returncode,
    }


def raw_load(files: list[Path]) -> Json:
    """Load the files of facts in a process that does nothing else; its start is not counted."""
    code = (
        "import sys, time, pyoxigraph as o\n"
        "store = o.Store(); begun = time.process_time()\n"
        "for name in sys.argv[1:]:\n"
        "    store.bulk_load(path=name, format=o.RdfFormat.TURTLE)\n"
        "print(time.process_time() - begun)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, *map(str, files)], check=True, capture_output=True, text=True
    )
    return {"seconds": float(told.stdout), "megabytes": None, "code": 0}


def workspace(size: int, folder: Path) -> Path:
    """Make and commit a home of about so many facts."""
    root = folder / "home"
    files = Workspace(root).first_files("kitchen")
    more = max(0, size - 1470) // FACTS_A_THING
    home = grown(read_files(bundled("kg") / "kitchen"), more)
    if size > LARGE * 20:  # too large for a file, and for `kg split`
        home |= dict(part for name in FACT_FILES for part in parts(name, home[name]))
    files |= {f"kg/kitchen/{name}": data for name, data in home.items()}
    for path, data in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_bytes(data)
    run = [["git", "init", "-q", "-b", "main"], ["git", "add", "."]]
    run.append(["git", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "start"])
    for command in run:
        subprocess.run(command, cwd=root, check=True)
    return root


def parts(name: str, data: bytes, most: int = 4 << 20) -> Iterator[tuple[str, bytes]]:
    """Divide a file of facts into several of about so many bytes."""
    head = data[: data.index(b"\n", data.rindex(b"\n@prefix") + 1) + 1]
    at, number = len(head), 1
    yield name, head
    while at < len(data):
        end = data.find(b"\n.\n", at + most)
        end = end + 3 if end >= 0 else len(data)
        yield f"{name.removesuffix('.ttl')}/object-{number}.ttl", head + data[at:end]
        at, number = end, number + 1


def measured(size: int, only: list[str], slow: set[str], patience: float) -> Iterator[Json]:
    """Measure every command at a size."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # In a process of its own: what a command uses is counted from what its parent uses.
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            root = pool.submit(workspace, size, folder).result()
        there = sorted((root / "kg" / "kitchen").rglob("*.ttl"))
        given = [
            path for path in there if graph_of(path.relative_to(root / "kg" / "kitchen").as_posix())
        ]
        facts = sum(path.read_bytes().count(b" ;\n") for path in given)
        yield {"what": LOAD, "size": size, "facts": facts, **raw_load(given)}
        (folder / "PLAN").write_text(PLAN)
        (folder / "ANSWERS").write_text(ANSWERS)
        with (folder / "GIVEN").open("wb") as joined:
            for path in given:
                joined.write(path.read_bytes() + b"\n")
        environment = {
            "PATH": os.environ["PATH"], "HOME": str(folder), "NO_COLOR": "1", "COLUMNS": "100",
            "PYTHONPATH": str(Path(__file__).parents[2]),
        }  # fmt: skip
        commands = (
            COMMANDS
            if size < LARGE
            else {SPLIT: ["kg", "split"], MADE: ["kg", "stats"], **COMMANDS}
        )
        for what, arguments in commands.items():
            if (only and what not in (*only, MADE)) or what in slow:
                continue
            at = root if what != "kg import" else folder / "empty"
            command = [sys.executable, "-m", "adaptbot_cli", *arguments, "--workspace", str(at)]
            for again in range(2 if what in WARM else 1):
                found = started(command, environment, folder)
                told = f"{what}, again" if again else what
                yield {"what": told, "size": size, "facts": facts, **found}
            if found["seconds"] > patience:
                slow.add(what)


def main() -> None:
    """Print a row for each command and size, and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="1000,10000,100000")
    parser.add_argument("--only", default="")
    parser.add_argument("--patience", type=float, default=120)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    kept = options.results
    rows: list[Json] = json.loads(kept.read_text()) if kept and kept.is_file() else []
    only, slow = [o for o in options.only.split(",") if o], set[str]()
    for size in map(int, filter(None, options.sizes.split(","))):
        raw = 0.0
        for row in measured(size, only, slow, options.patience):
            raw = row["seconds"] if row["what"] == LOAD else raw
            rows = [r for r in rows if (r["what"], r["size"]) != (row["what"], row["size"])]
            rows.append(row)
            memory = f"{row['megabytes']:7.0f} MB" if row["megabytes"] else " " * 10
            sys.stdout.write(
                f"{time.strftime('%H:%M:%S')} {row['facts']:>10,} {row['what']:34} "
                f"{row['seconds']:8.2f} s {row['seconds'] / raw:7.1f}x {memory} "
                f"exit {row['code']}\n"
            )
            sys.stdout.flush()
        if kept:
            kept.write_text(json.dumps(rows, indent=1))
    if options.plot:
        draw(rows, options.plot)


def draw(rows: list[Json], path: Path) -> None:
    """Draw processor time by the number of facts, a line a command."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from adaptbot_cli.evaluation.plots import STYLE

    rows = [row for row in rows if row["code"] in (0, 2)]
    names = dict.fromkeys(row["what"] for row in rows)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7, 4), layout="constrained")
        axes = figure.add_subplot()
        for n, what in enumerate(name for name in names if f"{name}, again" not in names):
            mine = sorted((r["facts"], r["seconds"]) for r in rows if r["what"] == what)
            style = {"color": "black", "linestyle": ":"} if what == LOAD else {}
            axes.loglog(*zip(*mine, strict=True), marker="osv^D<>"[n % 7], markersize=3,
                        linewidth=1, label=what.removesuffix(", again"), **style)  # fmt: skip
        axes.set_xlabel("facts in the home")
        axes.set_ylabel("processor time, s")
        axes.legend(fontsize=7, bbox_to_anchor=(1, 1), loc="upper left")
        figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    main()
