"""What a batch holds, to look at and to compute with: a page of pictures, and a table."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import quote

from partwright.atomic_io import replacing, write_bytes
from partwright.batch.directory import item_folder
from partwright.batch.manifest import DONE, Entry, latest

_SCORES = ("iou", "bi_surface_iou", "chamfer", "max_deviation_share", "max_protrusion_share")
_COLUMNS = (
    "file",
    "item",
    "status",
    "reason",
    "seconds",
    "peak_memory",
    "outcome",
    "parts",
    *_SCORES,
    "warnings",
)

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>
:root {{ color-scheme: light dark; font: 14px system-ui, sans-serif; }}
body {{ margin: 24px; }} h1 {{ font-size: 20px; }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(360px, 1fr)); gap: 16px; }}
figure {{ margin: 0; border: 1px solid #8884; border-radius: 6px; overflow: hidden; }}
img {{ width: 100%; display: block; background: #fff; aspect-ratio: 3; object-fit: contain; }}
figcaption {{ padding: 8px 10px; overflow-wrap: anywhere; }} .bad {{ color: #c33; }}
table {{ border-collapse: collapse; }} td {{ padding: 2px 12px 2px 0; vertical-align: top; }}
</style></head><body><h1>{title}</h1><p>{summary}</p>
"""


def write_index(output: Path) -> dict[str, Entry]:
    """index.html, index.csv, and with pyarrow index.parquet, in the batch's folder; returns its entries.

    Shapes come worst first, by IoU: that is what somebody looks for.

    Raises:
        OutputError: they cannot be written.
    """
    found = latest(output)
    ordered = sorted(found.values(), key=lambda entry: (entry.status == DONE, _iou(entry), entry.file))
    write_bytes(output / "index.csv", _table(ordered).encode())
    _parquet(ordered, output / "index.parquet")
    with replacing(output / "index.html") as path, path.open("w", encoding="utf-8") as page:
        page.write(
            _PAGE.format(title=escape(f"Batch: {output.resolve().name}"), summary=escape(summary(found)))
        )
        page.writelines(_failures(ordered))
        page.write("<main>\n")
        page.writelines(_figure(output, entry) for entry in ordered if entry.status == DONE)
        page.write("</main></body></html>\n")
    return found


def summary(found: Mapping[str, Entry]) -> str:
    """One line: how many, how good, how long."""
    counts = Counter(entry.status for entry in found.values())
    done = [entry for entry in found.values() if entry.status == DONE]
    text = f"{len(done)} of {len(found)} done"
    text += "".join(
        f", {count} {_WORDS[status]}" for status, count in sorted(counts.items()) if status != DONE
    )
    if done:
        seconds = [entry.seconds for entry in done if entry.seconds]
        text += f"; median IoU {median(map(_iou, done)):.3f}, {_counted(median(_parts(e) for e in done))}"
        if seconds:
            text += f", {median(seconds):.3g} s, at most {max(e.peak_memory for e in done) / 1e9:.2f} GB"
    return text


_WORDS = {"failed": "failed", "time": "out of time", "memory": "out of memory", "crashed": "crashed"}


def _iou(entry: Entry) -> float:
    return float(entry.result.get("scores", {}).get("iou", 0.0))


def _parts(entry: Entry) -> int:
    return int(entry.result.get("parts", 0))


def _counted(parts: float) -> str:
    return f"{parts:g} part{'s' * (parts != 1)}"


def _row(entry: Entry) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(entry, name) for name in _COLUMNS[:6]}
    scores = entry.result.get("scores", {})
    row |= {"outcome": entry.result.get("outcome", ""), "parts": entry.result.get("parts")}
    row |= {name: scores.get(name) for name in _SCORES}
    return row | {"warnings": "; ".join(entry.result.get("warnings", []))}


def _table(entries: Iterable[Entry]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(map(_row, entries))
    return text.getvalue()


def _parquet(entries: Iterable[Entry], path: Path) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:  # an extra: pip install "partwright[batch]"
        return
    kinds = dict.fromkeys(_COLUMNS, pyarrow.string()) | dict.fromkeys(
        ("seconds", *_SCORES), pyarrow.float64()
    )
    kinds |= {"peak_memory": pyarrow.int64(), "parts": pyarrow.int32()}
    table = pyarrow.Table.from_pylist(list(map(_row, entries)), pyarrow.schema(list(kinds.items())))
    with replacing(path) as temporary:
        pyarrow.parquet.write_table(table, temporary)


def _failures(entries: Iterable[Entry]) -> Iterable[str]:
    failed = [entry for entry in entries if entry.status != DONE]
    if failed:
        yield f'<details open><summary class="bad">{len(failed)} without a result</summary><table>\n'
        for entry in failed:
            cells = (entry.file, _WORDS.get(entry.status, entry.status), entry.reason)
            yield "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>\n"
        yield "</table></details>\n"


def _figure(output: Path, entry: Entry) -> str:
    folder = quote(item_folder(output, entry.item).relative_to(output).as_posix())
    scores = entry.result.get("scores", {})
    off = scores.get("max_deviation_share")
    words = f"{_counted(_parts(entry))}, IoU {_iou(entry):.3f}" + (
        f", at most {100 * off:.1f} % off" if off else ""
    )
    bad = "".join(f'<br><span class="bad">{escape(text)}</span>' for text in entry.result.get("warnings", []))
    return (
        f'<figure><a href="{folder}/"><img loading="lazy" src="{folder}/preview.png" alt=""></a>'
        f"<figcaption><b>{escape(entry.file)}</b><br>{words}{bad}</figcaption></figure>\n"
    )
