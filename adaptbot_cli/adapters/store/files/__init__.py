"""Writing files so that a kill, a full disk or a second process leaves no half of anything.

A change of several files is one unit. Its new contents are first written beside the old ones,
then a journal says that they hold (one rename: the moment from which on the change is made), then
they take the old ones' places. `recover` finishes or undoes what a kill interrupted; `settle` does
so for a reader, who holds no lock, and `settled` reads between two writes. A promise does the same
for the commit that goes with the files.
"""

from adaptbot_cli.adapters.store.files.journal import recover, write_files
from adaptbot_cli.adapters.store.files.lock import lock
from adaptbot_cli.adapters.store.files.promise import forget_promise, keep_promise, make_promise
from adaptbot_cli.adapters.store.files.settling import settle, settled

__all__ = [
    "forget_promise",
    "keep_promise",
    "lock",
    "make_promise",
    "recover",
    "settle",
    "settled",
    "write_files",
]
