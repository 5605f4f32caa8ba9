"""Edits outlive the server, whole or not at all."""

from __future__ import annotations

from pathlib import Path

from partwright.studio.journal import Journal
from partwright.studio.messages import Curve, Size, Step


def opened(folder: Path, original: str = "a") -> Journal:
    return Journal(folder / "state", folder / "mug.json", original)


def test_a_journal_is_as_it_was_left(tmp_path: Path) -> None:
    journal = opened(tmp_path)
    journal.commit("one", "b")
    journal.commit("two", "c")
    journal.undo()
    again = opened(tmp_path)  # the first was never closed: as after a kill
    assert (again.text, again.revision) == ("b", 3)
    assert again.past == [Step("one", "a")]
    assert again.future == [Step("two", "c")]
    again.redo()
    assert opened(tmp_path).text == "c"


def test_a_line_that_was_cut_short_costs_that_edit_alone(tmp_path: Path) -> None:
    opened(tmp_path).commit("one", "b")
    (path,) = (tmp_path / "state").glob("*.jsonl")
    with path.open("a") as out:
        out.write('{"action": "commit", "label": "tw')
    journal = opened(tmp_path)
    assert journal.text == "b"
    journal.commit("three", "d")
    assert opened(tmp_path).past[0] == Step("one", "a")


def test_a_file_that_was_changed_by_others_begins_anew_and_keeps_the_old_journal(tmp_path: Path) -> None:
    opened(tmp_path).commit("one", "b")
    journal = opened(tmp_path, "x")
    assert (journal.text, journal.past) == ("x", [])
    assert "kept as" in journal.note
    assert len(list((tmp_path / "state").glob("*.old"))) == 1


def test_a_curve_outlives_the_server_until_it_is_put_away(tmp_path: Path) -> None:
    curve = Curve([Size(1, 0.5, "a"), Size(2, 0.9, "b")], "mug by superfrusta")
    journal = opened(tmp_path)
    journal.keep_curve(curve)
    journal.commit("one", "b")
    again = opened(tmp_path)
    assert (again.curve, again.revision) == (curve, 1)
    again.keep_curve(None)
    assert opened(tmp_path).curve is None


def test_after_saving_the_file_is_the_journals_own(tmp_path: Path) -> None:
    journal = opened(tmp_path)
    journal.commit("one", "b")
    journal.mark_saved()
    journal.commit("two", "c")
    again = opened(tmp_path, "b")
    assert (again.text, again.saved) == ("c", "b")


def test_the_token_is_256_bits_its_owners_alone_and_stays(tmp_path: Path) -> None:
    token = opened(tmp_path).token()
    assert len(bytes.fromhex(token)) == 32
    assert opened(tmp_path).token() == token
    (path,) = (tmp_path / "state").glob("*.token")
    assert path.stat().st_mode & 0o077 == 0
    assert Journal(tmp_path / "state", tmp_path / "other.json", "").token() != token
