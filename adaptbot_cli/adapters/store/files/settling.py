"""What a reader does about an interrupted write."""

import os
from pathlib import Path

from adaptbot_cli.adapters.store.files.disk import FOLDER
from adaptbot_cli.adapters.store.files.journal import interrupted, recover
from adaptbot_cli.adapters.store.files.lock import lock


def settle(root: Path) -> None:
    """Finish or undo an interrupted write, under the lock; without one, nothing is touched.

    Waits for a writer that is at work. A workspace that may not be written is left as it is.
    Raises KnowledgeError as `lock` and `recover` do.
    """
    if interrupted(root) and os.access(root / FOLDER, os.W_OK):
        with lock(root):
            recover(root)
