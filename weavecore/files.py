"""Output files and folders: written whole or not at all.

A *target* is the path that a user named.  Its *draft* lies beside it, and takes the target's place in one step once it
has been read back and found equal:

    draft written, synced, read back   ──▶   exchanged with the target   ──▶   what was there removed

Whatever goes wrong, an error of the system or a signal, the old target or the new one is there and whole, and no draft
stays behind.  Several files are replaced all or none: where one cannot be, those before it are put back.  A process
that is killed outright leaves its drafts, ``.weavecore-HOST-PROCESS-NUMBER.part``; the next run that writes to the
same folder puts back what was moved aside, where the target is missing, and removes them.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import itertools
import os
import platform
import re
import shutil
import sys
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Optional, Union

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

_ATTEMPTS = 3
"""How often what must not be left undone is tried: a signal may interrupt it, and a disk may fail once."""

_HOST = f"{zlib.crc32(platform.node().encode('utf-8', 'replace')):08x}"
"""Stands for this machine in the names of drafts: only of its own processes it can be found out whether they run."""
_PART = re.compile(rf"\.weavecore-{_HOST}-(\d+)-\d+\.part")
_NUMBERS = itertools.count()
_STALE_SECONDS = 86_400.0
"""Age at which drafts are taken for left behind where processes cannot be asked for (Windows)."""

_NEW, _BEFORE, _NAME = "new", "before", "target"
"""In the draft of a folder: the new folder, the old one where it was moved aside, and a file with the target's name."""

_RENAME_EXCHANGE = 2
"""Flag of renameat2 on Linux (``linux/fs.h``), and of renamex_np on macOS (RENAME_SWAP, ``stdio.h``)."""
_AT_FDCWD = -100


def check_targets(paths: Iterable[PathLike], *, overwrite: bool = False, inputs: Iterable[PathLike] = ()) -> None:
    """Raise what `write_together` would raise before its first byte, without writing.

    Parameters
    ----------
    paths : iterable of path
    overwrite : bool
        Whether files that are there already may be replaced.
    inputs : iterable of path
        Files that are read, and must not be replaced.

    Raises
    ------
    OutputExists
        Where a file is there already and ``overwrite`` is False.
    NotWritten
        Where the folder is missing, the path is a folder, or two outputs, or an output and an input, are one file.
    """
    read = [Path(one) for one in inputs]
    seen: set[Path] = set()
    for path in paths:
        target = _resolved(path)
        _recover(target.parent)
        if target in seen:
            raise NotWritten(f"{path} is named for two outputs", remedy="Give each output its own file.")
        seen.add(target)
        with _raising_not_written(path):
            _check_target(Path(path), target, overwrite)
            if target.exists() and any(one.exists() and one.samefile(target) for one in read):
                raise NotWritten(f"{path} is the input, which would be lost", remedy="Give the output another name.")


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
    parts: list[Path] = []
    drafts: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            target = _resolved(path)
            with _raising_not_written(path):
                parts.append(_part_beside(target))
                # With the rights that a new file gets.
                os.close(os.open(parts[-1], os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
                drafts.append((parts[-1], target))
                _fill(parts[-1], content)
                if target.exists():
                    shutil.copymode(target, parts[-1])
        check_targets(contents, overwrite=overwrite)
        _replace_all(contents, drafts, parts)
    finally:
        _discard(parts)


def _replace_all(paths: Iterable[PathLike], drafts: list[tuple[Path, Path]], parts: list[Path]) -> None:
    """Put all drafts in the places of their targets, or none; what is made for that is appended to ``parts``."""
    before: list[Optional[Path]] = []
    try:
        for path, (_, target) in zip(paths, drafts):
            with _raising_not_written(path):
                # A single file is replaced in one step, so nothing would have to be put back.
                kept = _part_beside(target) if len(drafts) > 1 and target.exists() else None
                if kept is not None:
                    parts.append(kept)
                    _keep(target, kept)
                before.append(kept)
        for path, (draft, target) in zip(paths, drafts):
            with _raising_not_written(path):
                draft.replace(target)
    except BaseException:
        if any(draft.exists() for draft, _ in drafts):
            for (draft, target), kept in zip(drafts, before):
                if not draft.exists():
                    _put_back(kept, target)
        raise


def _keep(target: Path, kept: Path) -> None:
    """Give a file a second name, or make a copy where the file system has no links."""
    try:
        os.link(target, kept)
    except OSError:
        shutil.copy2(target, kept)


def _put_back(kept: Optional[Path], target: Path) -> None:
    for _ in range(_ATTEMPTS):
        with contextlib.suppress(OSError):
            if kept is None:
                target.unlink()
            else:
                kept.replace(target)
            return


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
    _recover(target.parent)
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
    part = _part_beside(target)
    with _raising_not_written(path):
        try:
            new = part / _NEW
            part.mkdir()
            new.mkdir()
            for name, content in contents.items():
                _fill(new / name, content)
            check_folder(path, known, overwrite=overwrite)
            if target.exists():
                shutil.copymode(target, new)
                _fill(part / _NAME, os.fsencode(target.name))
                _exchange(new, target, part / _BEFORE)
            else:
                new.rename(target)
        finally:
            _discard([part])


def _exchange(new: Path, target: Path, aside: Path) -> None:
    """Put a folder in the place of the target; what was there is back where that fails."""
    if _swap(new, target):
        return
    try:
        target.rename(aside)
        new.rename(target)
    finally:
        _restore(aside, target)


def _swap(one: Path, other: Path) -> bool:
    """Exchange two paths in one step, and return whether the system can."""
    try:
        library = ctypes.CDLL(None, use_errno=True)
        if sys.platform == "darwin":
            status = library.renamex_np(os.fsencode(one), os.fsencode(other), _RENAME_EXCHANGE)
        else:
            status = library.renameat2(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE)
    except (AttributeError, OSError, TypeError):  # Windows, or a C library without it.
        return False
    return bool(status == 0)


def _restore(aside: Path, target: Path) -> None:
    """Move a folder back where nothing has come into its place."""
    for _ in range(_ATTEMPTS):
        if os.path.lexists(target) or not os.path.lexists(aside):
            return
        with contextlib.suppress(OSError):
            aside.rename(target)


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


def _part_beside(target: Path) -> Path:
    """A path for a draft; the file's own name may be as long as names can be, so it is not part of it."""
    while True:
        part = target.parent / f".weavecore-{_HOST}-{os.getpid()}-{next(_NUMBERS)}.part"
        if not os.path.lexists(part):
            return part


def _discard(parts: Iterable[Path]) -> None:
    """Remove drafts; a signal that comes meanwhile is raised when that is done."""
    interruption: Optional[BaseException] = None
    for part in parts:
        for _ in range(_ATTEMPTS):
            try:
                _remove(part)
                break
            except OSError:
                continue
            except BaseException as error:  # noqa: BLE001 - it is raised below.
                interruption = error
    if interruption is not None:
        raise interruption


def _remove(part: Path) -> None:
    """Remove a draft, but not with a folder that was moved aside and has no other place."""
    if part.is_dir():
        if (part / _BEFORE).exists() and (part / _NAME).exists():
            target = part.parent / os.fsdecode((part / _NAME).read_bytes())
            _restore(part / _BEFORE, target)
            if not os.path.lexists(target):
                return
        shutil.rmtree(part)
    elif os.path.lexists(part):
        part.unlink()


def _recover(folder: Path) -> None:
    """Put back what a killed process moved aside, and remove its drafts."""
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(folder)):
            match = _PART.fullmatch(entry.name)
            if match and _is_left_behind(entry, int(match[1])):
                _discard([Path(entry.path)])


def _is_left_behind(entry: os.DirEntry[str], process: int) -> bool:
    if os.name == "nt" or process == os.getpid():
        # Other threads may write; a process of another container may have had the same number.
        return time.time() - entry.stat(follow_symlinks=False).st_mtime > _STALE_SECONDS
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except OSError:
        return False
    return False


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
