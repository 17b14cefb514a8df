"""Output files: written whole or not at all.

A *target* is the path that a user named.  Its *draft* is a file beside it, which takes the
target's place in one step once it has been read back and found equal.  Whatever goes wrong
before that step, what was at the target is whole and no draft stays behind.  A folder that is
written whole is drafted in the same way.
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
"""Remedies by the error number of the operating system."""


def check_targets(paths: Iterable[PathLike], *, overwrite: bool = False) -> None:
    """Raise what `write_together` would raise before its first byte, without writing.

    Parameters
    ----------
    paths : iterable of path
    overwrite : bool
        Whether files that are there already may be replaced.

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
        with _raising_not_written(path):
            _check_target(Path(path), target, overwrite)


def write_whole(path: PathLike, content: bytes, *, overwrite: bool = False) -> None:
    """Write one file; see `write_together`.

    Parameters
    ----------
    path : path
    content : bytes
    overwrite : bool
        Whether a file that is there already is replaced.

    Raises
    ------
    OutputExists, NotWritten
    """
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
            with _raising_not_written(path):
                draft = _open_draft(target)
                drafts.append((draft, target))
                _fill(draft, content)
                if target.exists():
                    shutil.copymode(target, draft)
        check_targets(contents, overwrite=overwrite)
        for path, (draft, target) in zip(contents, drafts):
            with _raising_not_written(path):
                draft.replace(target)
    finally:
        for draft, _ in drafts:
            with contextlib.suppress(OSError):
                draft.unlink()


def check_folder(path: PathLike, names: Iterable[str], *, overwrite: bool = False) -> None:
    """Raise what `write_folder` would raise before its first byte, without writing.

    Parameters
    ----------
    path : path
    names : iterable of str
        Files that the folder may hold and that may be lost.
    overwrite : bool
        Whether a folder that is there already may be replaced.

    Raises
    ------
    OutputExists
        Where the folder is there already, with files in it, and ``overwrite`` is False.
    NotWritten
        Where the folder above is missing, the path is a file, or the folder that would be replaced holds
        something that is not among ``names``.
    """
    target = _resolved(path)
    with _raising_not_written(path):
        if not target.exists():
            if not target.parent.is_dir():
                raise NotWritten(
                    f"The folder {Path(path).parent} does not exist", remedy="Make the folder first, or name another."
                )
            return
        if not target.is_dir():
            raise NotWritten(f"{path} is not a folder", remedy="Give the path of a folder.")
        strangers = sorted({one.name for one in target.iterdir()} - set(names))
        if strangers:
            raise NotWritten(
                f"The folder {path} holds other files, which would be lost",
                remedy="Name a folder of its own for the output.",
                ids=strangers,
                kind="file",
            )
        if not overwrite and any(target.iterdir()):
            remedy = "Choose another name, or overwrite it: --overwrite, overwrite=True."
            raise OutputExists(f"{path} exists already", remedy=remedy)


def write_folder(
    path: PathLike, contents: Mapping[str, bytes], *, names: Iterable[str] = (), overwrite: bool = False
) -> None:
    """Write a folder of files, which appears with all of them or not at all.

    Parameters
    ----------
    path : path
    contents : mapping of file name to bytes
    names : iterable of str
        Files that an earlier folder may hold besides, and that are lost when it is replaced.
    overwrite : bool
        Whether a folder that is there already is replaced.

    Raises
    ------
    OutputExists, NotWritten
    """
    known = {*contents, *names}
    check_folder(path, known, overwrite=overwrite)
    target = _resolved(path)
    drafts: list[Path] = []
    with _raising_not_written(path):
        try:
            drafts.append(_make_draft_folder(target))
            for name, content in contents.items():
                _fill(drafts[0] / name, content)
            check_folder(path, known, overwrite=overwrite)
            if target.exists():
                shutil.copymode(target, drafts[0])
                drafts.append(_make_draft_folder(target))
                _exchange(drafts[0], target, drafts[1] / "before")
            else:
                drafts[0].rename(target)
        finally:
            for draft in drafts:
                shutil.rmtree(draft, ignore_errors=True)


def _exchange(draft: Path, target: Path, aside: Path) -> None:
    """Put the draft in the place of the target; what was there is back where that fails."""
    target.rename(aside)
    try:
        draft.rename(target)
    except BaseException:
        aside.rename(target)
        raise


def _make_draft_folder(target: Path) -> Path:
    for attempt in range(1000):
        draft = target.parent / f".weavecore-{os.getpid()}-{attempt}.part"
        with contextlib.suppress(FileExistsError):
            draft.mkdir()
            return draft
    raise FileExistsError(errno.EEXIST, "Too many drafts lie in the folder", str(target.parent))


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
def _raising_not_written(path: PathLike) -> Iterator[None]:
    try:
        yield
    except (NotWritten, OutputExists):
        raise
    except OSError as error:
        raise NotWritten(
            f"{path} could not be written: {error.strerror or error}",
            remedy=_REMEDIES.get(
                error.errno or 0, "Check the path and the folder permissions, or write to another folder."
            ),
        ) from error
