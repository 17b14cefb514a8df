"""A folder of outputs appears with all its files or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from weavecore import files
from weavecore.errors import NotWritten, OutputExists

NEW = {"a.csv": b"new a", "b.csv": b"new b"}
OLD = {"a.csv": b"old a", "c.csv": b"old c"}


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def make_old(tmp_path: Path) -> Path:
    target = tmp_path / "out"
    target.mkdir()
    for name, content in OLD.items():
        (target / name).write_bytes(content)
    return target


def test_a_new_folder_holds_the_files_and_nothing_stays_beside_it(tmp_path: Path) -> None:
    files.write_folder(tmp_path / "out", NEW)
    assert content_of(tmp_path / "out") == NEW
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    files.write_folder(tmp_path / "out", NEW)
    assert content_of(tmp_path / "out") == NEW


def test_a_folder_that_is_there_is_kept_unless_it_may_be_replaced(tmp_path: Path) -> None:
    target = make_old(tmp_path)
    with pytest.raises(OutputExists):
        files.write_folder(target, NEW, names=OLD)
    assert content_of(target) == OLD
    files.write_folder(target, NEW, names=OLD, overwrite=True)
    assert content_of(target) == NEW
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_with_other_things_in_it_is_never_replaced(tmp_path: Path) -> None:
    target = make_old(tmp_path)
    (target / "thesis.doc").write_bytes(b"dear")
    with pytest.raises(NotWritten, match="other files") as refused:
        files.write_folder(target, NEW, names=OLD, overwrite=True)
    assert refused.value.ids == ("thesis.doc",)
    assert content_of(target) == {**OLD, "thesis.doc": b"dear"}


@pytest.mark.parametrize("broken", ["_fill", "_exchange"])
def test_when_writing_fails_what_was_there_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str
) -> None:
    target = make_old(tmp_path)

    def fail(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, broken, fail)
    with pytest.raises(NotWritten, match="No space left"):
        files.write_folder(target, NEW, names=OLD, overwrite=True)
    assert content_of(target) == OLD
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_old_folder_comes_back_when_the_new_one_cannot_take_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = make_old(tmp_path)
    rename = Path.rename

    def fail_for_drafts(self: Path, other: Path) -> Path:
        if self.name == "new":
            raise PermissionError(13, "Permission denied")
        return rename(self, other)

    monkeypatch.setattr(files, "_swap", lambda *_paths: False)  # As where the system cannot exchange two folders.
    monkeypatch.setattr(Path, "rename", fail_for_drafts)
    with pytest.raises(NotWritten, match="Permission denied"):
        files.write_folder(target, NEW, names=OLD, overwrite=True)
    assert content_of(target) == OLD
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_file_or_a_missing_folder_is_no_place(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(NotWritten, match="not a folder"):
        files.write_folder(tmp_path / "file", NEW, overwrite=True)
    with pytest.raises(NotWritten, match="does not exist"):
        files.write_folder(tmp_path / "nowhere" / "out", NEW)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
