"""The only wiring (`building`), and the only loop that performs turns (`driving`)."""

from adaptbot_cli.session.building import Request, Session, build
from adaptbot_cli.session.driving import Ports, drive, perform
from adaptbot_cli.session.inspecting import check_pack
from adaptbot_cli.session.loading import load
from adaptbot_cli.session.playing import check, check_request, replay
from adaptbot_cli.session.resuming import content_of, cut_off, guarded, header_of, is_own
from adaptbot_cli.session.starting import Started, start, take_over

__all__ = [
    "Ports",
    "Request",
    "Session",
    "Started",
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
