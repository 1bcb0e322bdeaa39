"""What errors in the graph cost in a world, and what puts them right.

    python tests/bench/bench_world.py [--published DIR] [--jobs N] [--plot docs/planted.svg]

The published recordings, carried out in the truth, with a share of errors planted in the places and
attributes that the arms start from: the goal met in the world, and the errors that answers and
observations put right. `--results DIR` keeps the reports and reads those that are there.
"""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.evaluation.figures import HEADS
from adaptbot_cli.evaluation.plots import COLOURS, DASHES, MARKERS, STYLE
from adaptbot_cli.evaluation.recordings import ARMS
from tests.bench.bench_eval import run

SHARES = (0.0, 0.05, 0.1, 0.2)
Json = dict[str, Any]


def reports(published: Path, jobs: int, kept: Path | None) -> dict[float, Json]:
    """Run the experiment with each share of errors; return the figures of the arms."""
    found = {}
    for share in SHARES:
        path = kept / f"planted-{share}.json" if kept else None
        if path is not None and path.is_file():
            found[share] = json.loads(path.read_text("utf-8"))
            continue
        found[share] = run(published, jobs, world=True, planted=share)["arms"]
        if path is not None:
            path.write_text(json.dumps(found[share]), "utf-8")
    return found


def draw(found: dict[float, Json], path: Path) -> None:
    """Draw the goal met in the world by the share of errors, an arm a line, with intervals."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.2, 2.8), layout="constrained")
        axes = figure.add_subplot()
        for n, arm in enumerate(ARMS):
            of_arm = [found[share][arm] for share in SHARES]
            values = [100 * m["world_goal_met"] for m in of_arm]
            ends = [m["intervals"]["world_goal_met"] for m in of_arm]
            errors = [
                [v - 100 * low for v, (low, _) in zip(values, ends, strict=True)],
                [100 * high - v for v, (_, high) in zip(values, ends, strict=True)],
            ]
            axes.errorbar(
                [100 * share + (n - 1) * 0.25 for share in SHARES],
                values,
                yerr=errors,
                color=COLOURS[arm],
                marker=MARKERS[n],
                linestyle=DASHES[n],
                linewidth=1,
                markersize=4,
                elinewidth=0.7,
                capsize=2,
                label=HEADS[arm],
            )
        axes.set_xlabel("errors planted in places and attributes, %")
        axes.set_ylabel("goal met in the world, %")
        axes.set_ylim(0, 100)
        axes.set_xticks([100 * share for share in SHARES])
        axes.set_title(f"n = {of_arm[0]['n']} tasks", loc="left")
        axes.legend(fontsize=7)
        figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Print a row for each share of errors and each arm."""
    here = Path(__file__).parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    usual = os.environ.get("ADAPTBOT_PUBLISHED", here.parent / "shared" / "published")
    parser.add_argument("--published", type=Path, default=Path(usual))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    found = reports(options.published, options.jobs, options.results)
    for share, arms in found.items():
        for arm, m in arms.items():
            low, high = m["intervals"]["world_goal_met"]
            sys.stdout.write(
                f"{share:4.0%} {arm:13} goal met in the world {m['world_goal_met']:4.0%} "
                f"[{low:.0%}, {high:.0%}] of {m['n']}; steps failed {m['steps_failed']:.2f}, "
                f"recovered {m['recovered']:.2f}; put right by the person "
                f"{m['repaired_by_person']:.2f}, by seeing {m['repaired_by_seeing']:.2f}\n"
            )
    if options.plot:
        draw(found, options.plot)


if __name__ == "__main__":
    main()
