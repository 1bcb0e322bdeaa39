"""Writing files so that a kill, a full disk or a second process leaves no half of anything.

A change of several files is one unit. Its new contents are first written beside the old ones,
then a journal says that they hold (one rename: the moment from which on the change is made), then
they take the old ones' places. `recover` finishes or undoes what a kill interrupted; `settle` does
so for a reader, who holds no lock.
"""

from adaptbot_cli.adapters.store.files.journal import recover, write_files
from adaptbot_cli.adapters.store.files.lock import lock
from adaptbot_cli.adapters.store.files.settling import settle

__all__ = ["lock", "recover", "settle", "write_files"]
