"""Outputs are written whole or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from weavecore import files
from weavecore.errors import NotWritten, OutputExists

ROOT = Path(__file__).resolve().parents[2]


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_new_file_has_the_content_and_nothing_stays_beside_it(tmp_path: Path) -> None:
    files.write_whole(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").read_bytes() == b"new"
    assert names_in(tmp_path) == ["a.json"]


def test_a_file_that_is_there_is_kept_unless_it_may_be_replaced(tmp_path: Path) -> None:
    target = tmp_path / "a.json"
    target.write_bytes(b"old")
    with pytest.raises(OutputExists, match=r"^EXISTS: .*a\.json"):
        files.write_whole(target, b"new")
    assert target.read_bytes() == b"old"
    files.write_whole(target, b"new", overwrite=True)
    assert target.read_bytes() == b"new"
    assert names_in(tmp_path) == ["a.json"]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotWritten, match=r"folder .*nowhere does not exist"):
        files.write_whole(tmp_path / "nowhere" / "a.json", b"new")
    assert names_in(tmp_path) == []


def test_a_folder_is_no_output(tmp_path: Path) -> None:
    with pytest.raises(NotWritten, match="folder or a device"):
        files.write_whole(tmp_path, b"new", overwrite=True)


def test_two_outputs_may_not_be_one_file(tmp_path: Path) -> None:
    with pytest.raises(NotWritten, match="two outputs"):
        files.check_targets([tmp_path / "a.json", tmp_path / "." / "a.json"])


def test_none_of_several_is_written_when_one_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "first.json").write_bytes(b"old")
    contents = {tmp_path / "first.json": b"new", tmp_path / ("n" * 300): b"new"}  # Longer than names may be.
    with pytest.raises(NotWritten):
        files.write_together(contents, overwrite=True)
    assert (tmp_path / "first.json").read_bytes() == b"old"
    assert names_in(tmp_path) == ["first.json"]


def test_what_is_read_back_different_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a.json"
    target.write_bytes(b"old")
    monkeypatch.setattr(Path, "read_bytes", lambda _: b"rotten")
    with pytest.raises(NotWritten, match="read back"):
        files.write_whole(target, b"new", overwrite=True)
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
    assert names_in(tmp_path) == ["a.json"]


@pytest.mark.skipif(os.name == "nt", reason="POSIX rights and links")
def test_rights_and_links_stay_as_they_were(tmp_path: Path) -> None:
    real, link = tmp_path / "real.json", tmp_path / "link.json"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to(real)
    files.write_whole(link, b"new", overwrite=True)
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    assert real.stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(os.name == "nt", reason="POSIX rights")
def test_a_new_file_has_the_rights_of_new_files(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    files.write_whole(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").stat().st_mode == (tmp_path / "plain").stat().st_mode


FULL_DISK = """
import resource, sys
from weavecore.errors import NotWritten
from weavecore.files import write_together
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    write_together({"small.json": b"s" * 10, "large.json": b"l" * 5000}, overwrite=True)
except NotWritten as error:
    print(error)
"""


@pytest.mark.skipif(os.name == "nt", reason="needs resource limits")
def test_a_disk_that_is_full_leaves_the_old_files_whole(tmp_path: Path) -> None:
    (tmp_path / "large.json").write_bytes(b"old")
    command = [sys.executable, "-c", FULL_DISK]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("NOT_WRITTEN: large.json could not be written")
    assert (tmp_path / "large.json").read_bytes() == b"old"
    assert names_in(tmp_path) == ["large.json"]


KILLED = """
import os, sys, time
from weavecore import files

def stop(*_):
    print("there", flush=True)
    time.sleep(60)

class Half:
    # Half of the content is on the disk when the process ends.
    def __init__(self, stream):
        self.stream = stream
    def __getattr__(self, name):
        return getattr(self.stream, name)
    def __enter__(self):
        return self
    def __exit__(self, *_):
        self.stream.close()
    def write(self, content):
        self.stream.write(content[: len(content) // 2])
        self.stream.flush()
        stop()

where, paths = sys.argv[1], sys.argv[2:]
if where == "writing":
    whole = files.Path.open
    files.Path.open = lambda self, mode="r": Half(whole(self, mode)) if mode == "wb" else whole(self, mode)
elif where == "before replacing":
    files.Path.replace = stop
elif where == "between two":
    once = files.Path.replace
    def replace(self, target):
        once(self, target)
        stop()
    files.Path.replace = replace
files.write_together({path: b"new" * 10000 for path in paths}, overwrite=True)
"""


def killed_while(where: str, *paths: Path) -> None:
    """Write to the paths in a process that is killed at a certain point."""
    command = [sys.executable, "-c", KILLED, where, *map(str, paths)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline().strip() == b"there"
        writer.kill()


@pytest.mark.parametrize("where", ["writing", "before replacing"])
def test_a_writer_that_is_killed_leaves_the_old_files_whole(tmp_path: Path, where: str) -> None:
    targets = [tmp_path / "a.json", tmp_path / "b.3dm"]
    for target in targets:
        target.write_bytes(b"old")
    killed_while(where, *targets)
    assert [target.read_bytes() for target in targets] == [b"old", b"old"]
    left = [name for name in names_in(tmp_path) if name not in ("a.json", "b.3dm")]
    assert all(name.startswith(".weavecore-") and name.endswith(".part") for name in left)
    files.write_together(dict.fromkeys(targets, b"newer"), overwrite=True)
    assert [target.read_bytes() for target in targets] == [b"newer", b"newer"]


def test_a_writer_that_is_killed_between_two_files_leaves_each_of_them_whole(tmp_path: Path) -> None:
    targets = [tmp_path / "a.json", tmp_path / "b.3dm"]
    for target in targets:
        target.write_bytes(b"old")
    killed_while("between two", *targets)
    assert [target.read_bytes() for target in targets] == [b"new" * 10000, b"old"]
