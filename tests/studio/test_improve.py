"""From the page: parts changed for a goal, the locked ones bit for bit, with the curve as it goes."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from partwright.assembly import Assembly, Part
from partwright.assembly.files import from_text
from partwright.errors import SettingError
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from partwright.methods import Cancellation, Progress
from partwright.studio import messages
from partwright.studio.improving import goals, improving
from tests.studio.conftest import Page, Server

pytest.importorskip("torch", reason="goals need PyTorch")

PLATE = Assembly(
    (Part(Box((2, 1, 0.4)), name="plate"), Part(Cylinder(0.3, 1.0), (0.6, 0, 0.6), name="post [1]")),
    unit="m",
    up="z",
)


def wish(**changed: object) -> messages.Improve:
    return messages.Improve(**{"goal": "volume", "axis": "x", "locked": ["plate"], "steps": 4} | changed)  # type: ignore[arg-type]


def test_only_parts_that_are_not_locked_change_and_every_step_is_told() -> None:
    heard: list[object] = []
    done = improving(PLATE, wish()).work(heard.append, Cancellation())
    assert done.assembly["plate"] == PLATE["plate"]
    assert done.assembly["post [1]"] != PLATE["post [1]"]
    curves = [one for one in heard if isinstance(one, messages.Improving)]
    tried = curves[-1].tried
    assert [one.number for one in tried] == list(range(len(tried)))
    kept = [one.value for one in tried if one.kept]
    assert kept[-1] < 0.95 * kept[0]
    shown = [one.assembly() for one in heard if isinstance(one, Progress) and one.best]
    assert shown[0] == PLATE
    assert shown[-1] == done.assembly
    locked = improving(PLATE, wish(locked=["post [1]"])).work(heard.append, Cancellation())
    assert locked.assembly["post [1]"] == PLATE["post [1]"]


def test_what_is_to_be_kept_is_kept() -> None:
    message = wish(locked=[], goal="frontal_area", volume=98.0, steps=6)
    done = improving(PLATE, message).work(lambda _: None, Cancellation())
    before, after = (mesh_assembly(one, 64).volume for one in (PLATE, done.assembly))
    assert after >= 0.97 * before
    free = improving(PLATE, wish(locked=[], goal="frontal_area", steps=6)).work(
        lambda _: None, Cancellation()
    )
    assert mesh_assembly(free.assembly, 64).volume < 0.97 * before


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"goal": "evil.py:run"}, "goal: expected one of volume"),
        ({"steps": 0}, "from 1 to"),
        ({"walls": 300.0}, "from 0 to 100"),
    ],
)
def test_no_files_and_no_nonsense(changed: dict[str, object], words: str) -> None:
    with pytest.raises(SettingError, match=words):
        improving(PLATE, wish(**changed))


def test_from_the_page(tmp_path: Path, serve: Callable[..., Server], new_page: Callable[..., Page]) -> None:
    pytest.importorskip("uvicorn", reason="the studio's server needs uvicorn")
    PLATE.save(tmp_path / "plate.json")
    page = new_page(1200, 900).open(serve("plate.json").url)
    page.wait("() => live.state?.goals.length > 0 && partwright.store.program.parts.length === 2")
    assert page.ask("() => live.state.goals") == goals()
    page.page.get_by_text("Towards a goal").click()
    page.page.get_by_label("Steps").fill("4")
    page.ask("() => partwright.store.locked.add(partwright.store.program.parts[0].id)")
    page.page.get_by_role("button", name="Improve all but locked").click()
    page.wait("() => partwright.store.undoLabel === 'Less volume' && !live.fit.running")
    after = from_text(page.assembly())
    assert after["plate"] == PLATE["plate"]
    assert after["post [1]"] != PLATE["post [1]"]
    told = page.page.locator(".improve .hint").inner_text()
    assert re.fullmatch(r"volume: 1\.0\S+ to 0\.\S+ \(-\d+\.\d+ %\), step \d of 4", told)
    assert page.page.locator(".goal-curve path").get_attribute("d").count("L") >= 1
    page.page.keyboard.press("Control+z")
    page.wait("() => !live.link.waiting.length")
    assert from_text(page.assembly()) == PLATE
    assert not page.errors
