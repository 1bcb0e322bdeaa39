"""Objects of a repository, written as git writes them."""

import os
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.adapters.store.files.disk import sync_folder

if TYPE_CHECKING:
    from dulwich.object_store import DiskObjectStore
    from dulwich.objects import ShaFile


def write_objects(store: "DiskObjectStore", objects: Iterable["ShaFile"]) -> None:
    """Write objects through to the disk, with their folders; those that are there stay.

    dulwich takes a lock for each object, and one that a kill leaves behind would keep the same
    object from ever being written again. git needs none: an object's name is its content. What a
    kill leaves behind here bears the name that `git gc` sweeps away.
    """
    written = {_write(store, item) for item in objects if item.id not in store}
    for folder in sorted(written):
        sync_folder(folder)
        sync_folder(folder.parent)


def _write(store: "DiskObjectStore", item: "ShaFile") -> Path:
    from dulwich.file import adjust_shared_perm

    name = item.id.decode()
    folder = Path(os.fsdecode(store.path)) / name[:2]
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        adjust_shared_perm(folder, store.shared_perm)
    handle, new = tempfile.mkstemp(prefix="tmp_obj_", dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(item.as_legacy_object(store.loose_compression_level))
            file.flush()
            os.fsync(file.fileno())
        Path(new).chmod(0o444)
        adjust_shared_perm(new, store.shared_perm)
        Path(new).replace(folder / name[2:])
    except BaseException:
        with suppress(OSError):
            Path(new).unlink()
        raise
    return folder
