"""The only wiring (`build`), and the only loop that performs turns (`drive`)."""

from adaptbot_cli.session.build import Request, Session, build
from adaptbot_cli.session.drive import Ports, drive, perform
from adaptbot_cli.session.graphs import load
from adaptbot_cli.session.packs import Started, start, take_over
from adaptbot_cli.session.replay import check, check_request, replay
from adaptbot_cli.session.runs import answered, content_of, cut_off, guarded, header_of, is_own
from adaptbot_cli.session.validation import check_pack

__all__ = [
    "Ports",
    "Request",
    "Session",
    "Started",
    "answered",
    "build",
    "check",
    "check_pack",
    "check_request",
    "content_of",
    "cut_off",
    "drive",
    "guarded",
    "header_of",
    "is_own",
    "load",
    "perform",
    "replay",
    "start",
    "take_over",
]
