"""A domain pack as a page to read: the classes, what is said of them, actions, tasks."""

from adaptbot_cli.core.handbook.page import handbook

__all__ = ["handbook"]
