"""Renew the tested versions: constraints.txt for the program, constraints-dev.txt for its tests.

    python3 tools/constraints.py            the newest versions that pyproject.toml allows
    python3 tools/constraints.py --check    only say what would move; exit code 1 if anything would

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


def resolved(*more: str) -> dict[str, str]:
    """Return each needed package's entry, by its name: version, platforms and hashes."""
    text = subprocess.run(
        ["uv", "pip", "compile", "pyproject.toml", "--universal", "--python-version", "3.11",
         "--generate-hashes", "--no-header", "--no-annotate", "--quiet",
         "--no-emit-index-url", "--no-emit-find-links", *more],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    entries = re.split(r"^(?=\S)", text, flags=re.MULTILINE)
    return {match[1]: entry for entry in entries if (match := PIN.match(entry))}


def pins(text: str) -> dict[str, str]:
    """Return the versions that a constraints file names, by package."""
    return dict(PIN.findall(text))


def moved(old: dict[str, str], new: dict[str, str]) -> list[str]:
    """Return a line for each package that is new, gone or of another version."""
    return [
        f"{name}: {old.get(name, 'not there')} -> {new.get(name, 'gone')}"
        for name in sorted(old.keys() | new.keys())
        if old.get(name) != new.get(name)
    ]


def main() -> int:
    """Resolve, compare, write, test."""
    options = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    options.add_argument("--check", action="store_true", help="write nothing, run nothing")
    only_check = options.parse_args().check
    needed = resolved("--group", "build").keys()
    entries = resolved("--group", "build", "--extra", "dev")
    base = "".join(entry for name, entry in entries.items() if name in needed)
    dev = "".join(entry for name, entry in entries.items() if name not in needed)
    texts = {BASE: HEAD + base, DEV: HEAD + "-r constraints.txt\n" + dev}
    lines = []
    for path, text in texts.items():
        lines += moved(pins(path.read_text()) if path.exists() else {}, pins(text))
    print("\n".join(lines) or "Nothing moved.")
    if only_check or not lines:
        return int(bool(lines))
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
    return subprocess.run(["bash", ".ci/run"], cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
