"""Keeps secrets out of all that is shown, recorded or raised: they are cut out of what comes in."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

GONE = "[secret]"
_NAMES = re.compile(
    r"(^|_)(KEY|APIKEY|TOKEN|SECRET|PASSWORD|PASSWD|CREDENTIALS?|AUTHORIZATION)(_|$)", re.I
)
_SHORTEST = 8
"""Shorter values are words such as `none`, that a text may well hold."""

_LOOKS_SECRET = re.compile(
    r"\b(?:sk|pk|gsk|hf|key|api)[-_][\w*.-]{6,}"  # a provider's prefix, or a masked key
    r"|\bbearer\s+\S+"
    r"|(?<=://)[^/\s@]+@"  # user and password in an address
    r"|\b[\w.-]*(?:key|token|secret|password|signature)[\w-]*[\"']?\s*[=:]\s*[\"']?[^\s\"'&,}]+"
    r"|(?=[\w+/=-]*\d)(?=[\w+/=-]*[A-Za-z])[\w+/=-]{24,}",  # long, of letters and digits
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Secrets:
    """The values that must not get out, longest first."""

    values: tuple[str, ...] = ()

    def cut(self, text: str) -> str:
        """Return a text without the known secrets."""
        for value in self.values:
            text = text.replace(value, GONE)
        return text

    def detail(self, text: str, longest: int = 160) -> str:
        """Return a provider's words without the known secrets and all that looks like one."""
        return _LOOKS_SECRET.sub(GONE, self.cut(" ".join(text.split())))[:longest]


def secrets(environ: Mapping[str, str], *addresses: str | None) -> Secrets:
    """Return the secrets of an environment, and those in addresses (user, password, query)."""
    found = {value.strip() for name, value in environ.items() if _NAMES.search(name)}
    for address in addresses:
        found |= set(in_address(address or ""))
    values = {value for value in found if len(value) >= _SHORTEST}
    return Secrets(tuple(sorted(values, key=lambda value: (-len(value), value))))


def in_address(address: str) -> Iterable[str]:
    """Return what is secret in an address: user, password, query; each may be empty."""
    try:
        parts = urlsplit(address)
    except ValueError:
        return
    yield parts.netloc.rpartition("@")[0]
    yield parts.password or ""
    yield parts.query


@dataclass(slots=True)
class Sieve:
    """Lets a stream of pieces through without the known secrets, also where pieces split them."""

    secrets: Secrets
    held: str = ""

    def let(self, piece: str) -> str:
        """Return what may be shown now; what may be the beginning of a secret is held back."""
        text = self.secrets.cut(self.held + piece)
        keep = max((_overlap(text, value) for value in self.secrets.values), default=0)
        self.held = text[len(text) - keep :]
        return text[: len(text) - keep]

    def rest(self) -> str:
        """Return what is still held back, at the end."""
        text, self.held = self.held, ""
        return text


def _overlap(text: str, value: str) -> int:
    """How many characters at the end of a text are a beginning of the value, but not all of it."""
    longest = min(len(text), len(value) - 1)
    return next((n for n in range(longest, 0, -1) if text.endswith(value[:n])), 0)
