"""What each objective and bound measured, step by step, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from partwright.goals.problem import Problem
from partwright.goals.search import Step
from partwright.render import sheet, write_png
from partwright.render.sheet import INK, SOFT_INK, draw_text

_WIDTH, _HEIGHT = 440, 260
_LEFT, _RIGHT, _TOP, _BOTTOM = 78, 18, 14, 34
_LINE, _LIMIT, _REFUSED = (40, 90, 170), (190, 60, 50), (200, 205, 214)


def curves(problem: Problem, steps: Sequence[Step], path: Path) -> None:
    """PNG: a panel for the weighted sum and one for each measure; limits are lines, refused steps grey."""
    accepted = [step for step in steps if step.accepted]
    panels = [_panel([(s.number, s.value) for s in accepted], [], [])]
    captions = ["weighted sum"]
    for name in problem.measures:
        limits = [b.value.beside(problem.terms[name][0].value) for b in problem.bounds if b.name == name]
        begin = problem.terms[name][0].value
        limits += [w.target.beside(begin) for w in problem.wanted if w.name == name and w.target is not None]
        refused = [(s.number, s.numbers[name]) for s in steps if not s.accepted and s.numbers]
        panels.append(_panel([(s.number, s.numbers[name]) for s in accepted], refused, limits))
        captions.append(name)
    write_png(path, sheet(panels, captions, columns=min(2, len(panels))))


def _panel(
    line: Sequence[tuple[int, float]], dots: Sequence[tuple[int, float]], limits: Sequence[float]
) -> np.ndarray:
    from PIL import Image, ImageDraw

    canvas = Image.new("RGB", (_WIDTH, _HEIGHT), "white")
    draw = ImageDraw.Draw(canvas)
    values = [value for _, value in line] + list(limits)
    low, high = min(values), max(values)
    room = 0.08 * (high - low) or 0.05 * abs(high) or 1.0
    low, high = low - room, high + room
    last = max(1, *(number for number, _ in [*line, *dots]))

    def place(number: float, value: float) -> tuple[float, float]:
        x = _LEFT + (_WIDTH - _LEFT - _RIGHT) * number / last
        return x, _TOP + (_HEIGHT - _TOP - _BOTTOM) * (high - value) / (high - low)

    draw.rectangle((_LEFT, _TOP, _WIDTH - _RIGHT, _HEIGHT - _BOTTOM), outline=SOFT_INK)
    for limit in limits:
        draw.line([place(0, limit), place(last, limit)], fill=_LIMIT)
    for number, value in dots:
        if low < value < high:
            x, y = place(number, value)
            draw.ellipse((x - 2, y - 2, x + 2, y + 2), fill=_REFUSED)
    draw.line([place(*one) for one in line], fill=_LINE, width=2)
    for one in line:
        x, y = place(*one)
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), fill=_LINE)
    ticks = np.linspace(low + room, high - room, 3)
    labels = [(_LEFT / 2, place(0, value)[1], f"{value:.4g}") for value in ticks]
    labels += [(place(n, 0)[0], _HEIGHT - _BOTTOM / 2, str(n)) for n in sorted({0, last // 2, last})]
    return draw_text(np.asarray(canvas), labels, size=12, colour=INK)
