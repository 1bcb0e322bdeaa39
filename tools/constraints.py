"""Renew the tested versions: constraints.txt for the program, constraints-dev.txt for its tests.

    python3 tools/constraints.py            the newest versions that pyproject.toml allows
    python3 tools/constraints.py --check    only say what would move; exit code 1 if anything would
    python3 tools/constraints.py --write    write the files, but do not start `.ci/run`

Needs uv (`pip install uv`), which resolves for every platform and writes the hashes of all files of
a release. The files hold versions and hashes, and no address they came from. After a renewal
`.ci/run` is started; commit the files only if it ends well.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BASE, DEV = ROOT / "constraints.txt", ROOT / "constraints-dev.txt"
PIN = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", re.MULTILINE)
HEAD = "# Written by tools/constraints.py: the tested versions, with the hashes of their files.\n"


def resolved(*more: str) -> list[tuple[str, str]]:
    """Return the needed packages, each with its entry: version, platforms and hashes.

    A package has several entries where platforms or Pythons need different versions.
    """
    text = subprocess.run(
        ["uv", "pip", "compile", "pyproject.toml", "--universal", "--python-version", "3.11",
         "--generate-hashes", "--no-header", "--no-annotate", "--quiet",
         "--no-emit-index-url", "--no-emit-find-links", *more],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    entries = re.split(r"^(?=\S)", text, flags=re.MULTILINE)
    return [(match[1], entry) for entry in entries if (match := PIN.match(entry))]


def pins(text: str) -> dict[str, str]:
    """Return the versions that a constraints file names, by package."""
    versions: dict[str, str] = {}
    for name, version in PIN.findall(text):
        versions[name] = f"{versions[name]} or {version}" if name in versions else version
    return versions


def moved(old: dict[str, str], new: dict[str, str]) -> list[str]:
    """Return a line for each package that is new, gone or of another version."""
    return [
        f"{name}: {old.get(name, 'not there')} -> {new.get(name, 'gone')}"
        for name in sorted(old.keys() | new.keys())
        if old.get(name) != new.get(name)
    ]


def main() -> int:
    """Resolve, compare, write, test."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing, run nothing")
    parser.add_argument("--write", action="store_true", help="write, but run nothing")
    options = parser.parse_args()
    needed = {name for name, _ in resolved("--group", "build")}
    entries = resolved("--group", "build", "--extra", "dev")
    base = "".join(entry for name, entry in entries if name in needed)
    dev = "".join(entry for name, entry in entries if name not in needed)
    texts = {BASE: HEAD + base, DEV: HEAD + "-r constraints.txt\n" + dev}
    lines = []
    for path, text in texts.items():
        lines += moved(pins(path.read_text()) if path.exists() else {}, pins(text))
    print("\n".join(lines) or "Nothing moved.")
    if options.check or not lines:
        return int(bool(lines))
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
    if options.write:
        return 0
    return subprocess.run(["bash", ".ci/run"], cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
