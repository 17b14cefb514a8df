"""Output files: written whole or not at all.

A *target* is the path that a user named.  Its *draft* is a file beside it, which takes the
target's place in one step once it has been read back and found equal.  Whatever goes wrong
before that step, what was at the target is whole and no draft stays behind.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Union

from weavecore.errors import NotWritten, OutputExists

PathLike = Union[str, "os.PathLike[str]"]

_REMEDIES = {
    errno.ENOSPC: "Free some space on the disk, or write to another one.",
    errno.EDQUOT: "Free some space on the disk, or write to another one.",
    errno.EFBIG: "Write to a place that allows larger files, or choose a larger spacing.",
    errno.EROFS: "Write to a folder that can be written to.",
    errno.EACCES: "Close the file in other programs, or write to a folder that is yours.",
    errno.EPERM: "Close the file in other programs, or write to a folder that is yours.",
}


def check_targets(paths: Iterable[PathLike], *, overwrite: bool = False) -> None:
    """Raise what `write_together` would raise before its first byte, without writing.

    Raises
    ------
    OutputExists
        Where a file is there already and ``overwrite`` is False.
    NotWritten
        Where the folder is missing, the path is a folder, or two outputs are one file.
    """
    seen: set[Path] = set()
    for path in paths:
        target = _resolved(path)
        if target in seen:
            raise NotWritten(f"{path} is named for two outputs", remedy="Give each output its own file.")
        seen.add(target)
        with _told_as_not_written(path):
            _check_target(Path(path), target, overwrite)


def write_whole(path: PathLike, content: bytes, *, overwrite: bool = False) -> None:
    """Write one file; see `write_together`."""
    write_together({path: content}, overwrite=overwrite)


def write_together(contents: Mapping[PathLike, bytes], *, overwrite: bool = False) -> None:
    """Write several files, none of which appears before all of them are complete.

    Parameters
    ----------
    contents : mapping of path to bytes
    overwrite : bool
        Whether files that are there already are replaced.

    Raises
    ------
    OutputExists, NotWritten
    """
    check_targets(contents, overwrite=overwrite)
    drafts: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            target = _resolved(path)
            with _told_as_not_written(path):
                draft = _open_draft(target)
                drafts.append((draft, target))
                _fill(draft, content)
                if target.exists():
                    shutil.copymode(target, draft)
        check_targets(contents, overwrite=overwrite)
        for path, (draft, target) in zip(contents, drafts):
            with _told_as_not_written(path):
                draft.replace(target)
    finally:
        for draft, _ in drafts:
            with contextlib.suppress(OSError):
                draft.unlink()


def _resolved(path: PathLike) -> Path:
    """The file itself where the path is a link to it, so that the link stays one."""
    return Path(os.path.realpath(path))


def _check_target(path: Path, target: Path, overwrite: bool) -> None:
    if target.exists():
        if not target.is_file():
            raise NotWritten(f"{path} is a folder or a device", remedy="Give the path of a file.")
        if not overwrite:
            remedy = "Choose another name, or overwrite it: --overwrite, overwrite=True."
            raise OutputExists(f"{path} exists already", remedy=remedy)
    elif not target.parent.is_dir():
        raise NotWritten(f"The folder {path.parent} does not exist", remedy="Make the folder first, or name another.")


def _open_draft(target: Path) -> Path:
    """Make an empty draft beside the target, with the rights that a new file gets."""
    for attempt in range(1000):
        # The process and a counter keep two runs apart; the file's own name may be as long as names can be.
        draft = target.parent / f".weavecore-{os.getpid()}-{attempt}.part"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            return draft
    raise FileExistsError(errno.EEXIST, "Too many drafts lie in the folder", str(target.parent))


def _fill(draft: Path, content: bytes) -> None:
    with draft.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    if draft.read_bytes() != content:
        raise OSError(errno.EIO, "What was read back differs from what was written")


@contextlib.contextmanager
def _told_as_not_written(path: PathLike) -> Iterator[None]:
    try:
        yield
    except (NotWritten, OutputExists):
        raise
    except OSError as error:
        raise NotWritten(
            f"{path} could not be written: {error.strerror or error}",
            remedy=_REMEDIES.get(error.errno or 0, "Look at the folder and its rights, or write to another one."),
        ) from error
