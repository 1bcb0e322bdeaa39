"""A SPARQL 1.1 server: queries and updates over HTTP, bounded; what goes wrong is a sentence.

A password comes from the environment alone, goes to the configured addresses alone, and no redirect
is followed. Terms are written by the engine, never pasted.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Final
from urllib.parse import urlsplit

import httpx
import pyoxigraph

from adaptbot_cli.bounded import GRAPH
from adaptbot_cli.errors import KnowledgeError

USER, PASSWORD, TOKEN = "ADAPTBOT_KG_USER", "ADAPTBOT_KG_PASSWORD", "ADAPTBOT_KG_TOKEN"
_SECONDS: Final = httpx.Timeout(60.0, connect=10.0)
_JSON: Final = pyoxigraph.QueryResultsFormat.JSON
_OLDER: Final = (b'"typed-literal"', b'"literal"')
"""What an early draft of the results' form, and Virtuoso still, call a literal with a datatype."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where a server is asked and, if it takes updates elsewhere, where it is told.

    Methods raise KnowledgeError: it cannot be reached, denies access, is no SPARQL server, or
    answers what cannot be read.
    """

    url: str
    update_url: str
    environ: Mapping[str, str]

    def ask(self, query: str, graphs: tuple[str, ...] = ()) -> Any:
        """Return the solutions, or the yes or no, of a query over the union of some graphs."""
        data = {"query": query, "default-graph-uri": list(graphs)}
        answer = self._post(self.url, data, "application/sparql-results+json")
        try:
            found: Any = pyoxigraph.parse_query_results(answer.replace(*_OLDER), _JSON)
            if isinstance(found, pyoxigraph.QueryBoolean):
                return bool(found)
            return [tuple(row) for row in found]
        except (SyntaxError, ValueError, OSError) as error:
            raise self._unlike(
                self.url, f"its answer is none to a SPARQL query ({error})"
            ) from error

    def update(self, text: str) -> None:
        """Have an update carried out."""
        self._post(self.update_url, {"update": text}, "*/*")

    def _post(self, url: str, data: Mapping[str, Any], accept: str) -> bytes:
        where = _shown(url)
        try:
            with (
                _client().stream(
                    "POST", url, data=data, headers={"Accept": accept}, auth=self._auth()
                ) as answer,
            ):
                body = bytearray()
                for part in answer.iter_bytes():
                    body += part
                    if len(body) > GRAPH:
                        raise KnowledgeError(f"{where} answers with more than {GRAPH} bytes")
        except httpx.TimeoutException as error:
            raise self._unlike(url, "it does not answer in time") from error
        except (httpx.HTTPError, httpx.InvalidURL, OSError, ValueError) as error:
            raise self._unlike(url, str(error) or type(error).__name__) from error
        if answer.status_code in (401, 403):
            named = f"{USER} and {PASSWORD}, or {TOKEN}, in the environment"
            raise self._unlike(url, f"access is denied; it is given with {named}")
        if answer.is_redirect:
            to = _shown(answer.headers.get("location", ""))
            raise self._unlike(url, f"it leads to {to}; name that, redirects are not followed")
        if not answer.is_success:
            text = " ".join(bytes(body).decode("utf-8", "replace").split())[:200]
            raise self._unlike(url, f"it answers {answer.status_code}: {text}")
        return bytes(body)

    def _auth(self) -> Any:
        user, password = self.environ.get(USER), self.environ.get(PASSWORD)
        if token := self.environ.get(TOKEN):
            return partial(_with_token, token)
        return _Asked(user, password) if user and password else None

    def _unlike(self, url: str, text: str) -> KnowledgeError:
        return KnowledgeError(f"the shared graph at {_shown(url)} could not be used: {text}")


@cache
def _client() -> httpx.Client:
    return httpx.Client(timeout=_SECONDS, follow_redirects=False)


def _with_token(token: str, request: httpx.Request) -> httpx.Request:
    request.headers["Authorization"] = f"Bearer {token}"
    return request


class _Asked(httpx.Auth):
    """A name and a password, as the server asks for them: basic or digest."""

    def __init__(self, user: str, password: str) -> None:
        self._user, self._password = user, password

    def auth_flow(self, request: httpx.Request) -> Any:
        answer = yield request
        if answer.status_code == 401:
            asked = answer.headers.get("www-authenticate", "").lower()
            kind = httpx.DigestAuth if asked.startswith("digest") else httpx.BasicAuth
            flow = kind(self._user, self._password).auth_flow(request)
            sent = next(flow)
            if kind is httpx.DigestAuth:
                sent = flow.send(answer)
            yield sent


def endpoint_of(
    settings: Mapping[str, Any], environ: Mapping[str, str] = os.environ
) -> Endpoint | None:
    """Return the server that settings and environment name, None if they name none."""
    url = environ.get("ADAPTBOT_KG_ENDPOINT") or settings.get("kg.endpoint")
    text = environ.get("ADAPTBOT_KG_UPDATE_ENDPOINT") or settings.get("kg.update_endpoint")
    return Endpoint(str(url), str(text or url), environ) if url else None


def _shown(url: str) -> str:
    """An address without what may be secret in it."""
    parts = urlsplit(url)
    port = f":{parts.port}" if parts.port else ""
    return f"{parts.scheme}://{parts.hostname or ''}{port}{parts.path}"
