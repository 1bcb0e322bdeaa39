"""From the files of a domain pack to a `Domain`, with a fault for whatever is wrong in them."""

from adaptbot_cli.core.pack.examine import Sources, examine_domain, with_tasks

__all__ = ["Sources", "examine_domain", "with_tasks"]
