"""How the house is built: numbers of its source by which clutter is seen to come and go.

    python benchmarks/house.py before=TREE now=. --output benchmarks/results/house.md

Each NAME=TREE is a column: a folder that holds the package `partwright/`, as a checkout does. Only the syntax
is read; nothing of it is imported or run. Exactly counted:

- Signatures: parameters of functions and methods, `*args` and `**options` one each, `self` and `cls` none.
- Function lines: from `def` to the last line, docstring and inner functions included.
- Tests on kinds of field: calls of `isinstance` that name `Field` or a class derived from it somewhere in the
  tree, however many kinds one names; class patterns of `match`, which are tests just as well, have a row.
- Imports inside functions: statements there that import the package's own modules.
- Cycles: files of one room (a folder of the package) that reach themselves through imports within the room,
  those inside functions counted, those for types alone not.
- Levenberg-Marquardt loops: functions with a loop that assigns a product or quotient in which a name with
  "damping" takes part: what makes a loop of the method is that the damping follows success.
- Hand-written columns: integers in a subscript of `row`, or in the last place of one of `rows` or
  `parameters`, be they names or attributes: `row[7]`, `rows[:, 3:7]`, `leaf.row[3:7]`.
- Duplicates: what the command `duplicates` counts of the package, left out where it is not installed.
"""

from __future__ import annotations

import argparse
import ast
import re
import shutil
import statistics
import subprocess
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import networkx

PACKAGE = "partwright"
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class File:
    module: str
    """Dotted name: partwright.fields.kernel; that of a package for its __init__."""
    path: Path
    text: str
    tree: ast.Module = field(repr=False)

    @property
    def lines(self) -> int:
        return len(self.text.splitlines())

    @property
    def room(self) -> str:
        return ".".join(self.module.split(".")[:2])

    @cached_property
    def functions(self) -> list[Function]:
        return [node for node in ast.walk(self.tree) if isinstance(node, Function)]


class House:
    """The package of one source tree."""

    def __init__(self, tree: Path) -> None:
        self.root = tree / PACKAGE
        if not self.root.is_dir():
            raise SystemExit(f"house: {tree} holds no package {PACKAGE}")
        self.files = [self._read(path) for path in sorted(self.root.rglob("*.py"))]
        self.modules = {file.module for file in self.files}

    def _read(self, path: Path) -> File:
        parts = (PACKAGE, *path.relative_to(self.root).with_suffix("").parts)
        text = path.read_text()
        return File(".".join(parts).removesuffix(".__init__"), path, text, ast.parse(text))

    def functions(self) -> Iterator[tuple[str, Function]]:
        for file in self.files:
            for function in file.functions:
                yield f"{file.module}.{function.name}", function

    def public_fit(self) -> int:
        """Parameters of `pw.fit`: the function of that name at the top of the room `fitting`."""
        room = f"{PACKAGE}.fitting"
        found = [
            node
            for file in self.files
            if file.room == room
            for node in file.tree.body
            if isinstance(node, Function) and node.name == "fit"
        ]
        (fit,) = found
        return parameters(fit)

    @cached_property
    def field_kinds(self) -> frozenset[str]:
        """Names of Field and of the classes derived from it."""
        classes = [
            node for file in self.files for node in ast.walk(file.tree) if isinstance(node, ast.ClassDef)
        ]
        kinds = {"Field"}
        while more := {c.name for c in classes if kinds & set(names(c.bases))} - kinds:
            kinds |= more
        return frozenset(kinds)

    def field_tests(self) -> list[str]:
        """Calls of isinstance that name kinds of field."""
        return [
            f"{file.module}:{node.lineno}"
            for file in self.files
            for node in ast.walk(file.tree)
            if isinstance(node, ast.Call) and names([node.func]) == ["isinstance"]
            if self.field_kinds & set(names(node.args[1:]))
        ]

    def field_patterns(self) -> list[str]:
        """Class patterns of match that name a kind of field."""
        return [
            f"{file.module}:{node.lineno}"
            for file in self.files
            for node in ast.walk(file.tree)
            if isinstance(node, ast.MatchClass) and self.field_kinds & set(names([node.cls]))
        ]

    def lazy_imports(self) -> list[str]:
        return [
            f"{file.module}:{node.lineno}"
            for file in self.files
            for node in {n for function in file.functions for n in ast.walk(function)}
            if self._imported(file, node)
        ]

    def files_in_cycles(self) -> list[str]:
        graph = networkx.DiGraph()
        rooms = {file.module: file.room for file in self.files}
        for file in self.files:
            for_types = {
                inner
                for node in ast.walk(file.tree)
                if isinstance(node, ast.If) and names([node.test])[-1:] == ["TYPE_CHECKING"]
                for inner in ast.walk(node)
            }
            for node in ast.walk(file.tree):
                if node not in for_types:
                    to = (module for module in self._imported(file, node) if rooms[module] == file.room)
                    graph.add_edges_from((file.module, module) for module in to)
        cycles = networkx.strongly_connected_components(graph)
        return sorted(module for cycle in cycles if len(cycle) > 1 for module in cycle)

    def _imported(self, file: File, node: ast.AST) -> list[str]:
        """The package's modules that a statement imports: a name's own module where it is one."""
        if isinstance(node, ast.Import):
            wanted = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                package = file.module if file.path.name == "__init__.py" else file.module.rpartition(".")[0]
                base = ".".join(
                    [*package.split(".")[: len(package.split(".")) - node.level + 1], *base.split(".")]
                )
            modules = [f"{base}.{alias.name}" for alias in node.names]
            wanted = [module if module in self.modules else base for module in modules]
        else:
            return []
        return [module for module in wanted if module in self.modules]

    def damping_loops(self) -> list[str]:
        return [name for name, function in self.functions() if any(map(_damps, _loops(function)))]

    def written_columns(self) -> list[str]:
        return [
            f"{file.module}:{node.lineno}"
            for file in self.files
            for node in ast.walk(file.tree)
            if isinstance(node, ast.Subscript) and _column(node)
        ]

    def duplicates(self) -> str:
        """Pairs of places that share lines, those of mere boilerplate left out."""
        command = ["duplicates", "--repo", str(self.root), "--seconds", "60", "--most", "200"]
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        if re.search(r"^incomplete:", printed, re.MULTILINE) or re.search(
            r"^\(\+\d+ more pairs\)", printed, re.M
        ):
            raise SystemExit(f"house: not all duplicates were listed:\n{printed[-500:]}")
        rows = [line for line in printed.splitlines() if re.match(r"D\d+ ", line)]
        return str(sum("boilerplate" not in row for row in rows))


def names(nodes: Iterable[ast.AST]) -> list[str]:
    """Last names of what is mentioned: Box for `fields.Box`, both of `(Box, Sphere)` and `Box | Sphere`."""
    found = []
    for node in nodes:
        if isinstance(node, ast.Name):
            found.append(node.id)
        elif isinstance(node, ast.Attribute):
            found.append(node.attr)
        elif isinstance(node, ast.Subscript):
            found += names([node.value])
        elif isinstance(node, ast.Tuple):
            found += names(node.elts)
        elif isinstance(node, ast.BinOp):
            found += names([node.left, node.right])
    return found


def parameters(function: Function) -> int:
    given = function.args
    plain = [a.arg for a in (*given.posonlyargs, *given.args)]
    own = plain[:1] in (["self"], ["cls"])
    return len(plain) - own + len(given.kwonlyargs) + (given.vararg is not None) + (given.kwarg is not None)


def lines(function: Function) -> int:
    return (function.end_lineno or function.lineno) - function.lineno + 1


def _loops(function: Function) -> Iterator[ast.AST]:
    """The loops of the function itself, not those of functions inside it."""
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.For | ast.While):
            yield node
        elif not isinstance(node, Function | ast.ClassDef):
            waiting += ast.iter_child_nodes(node)


def _damps(loop: ast.AST) -> bool:
    """Whether a damping grows or falls by a factor in the loop."""
    for node in ast.walk(loop):
        if isinstance(node, ast.AugAssign | ast.Assign):
            said = {n for part in ast.walk(node) for n in names([part])}
            scaled = any(isinstance(part, ast.Mult | ast.Div) for part in ast.walk(node))
            if scaled and any("damping" in name.lower() for name in said):
                return True
    return False


def _column(node: ast.Subscript) -> bool:
    """Whether a subscript picks columns of parameter rows by numbers."""
    last = names([node.value])[-1:] if isinstance(node.value, ast.Name | ast.Attribute) else []
    index = node.slice
    if last in (["row"], ["rows"], ["parameters"]) and isinstance(index, ast.Tuple):
        return _numbered(index.elts[-1])
    return last == ["row"] and _numbered(index)


def _numbered(index: ast.AST) -> bool:
    """Whether an index, a slice's end or one of a list is an integer."""
    if isinstance(index, ast.Slice):
        return any(_numbered(end) for end in (index.lower, index.upper) if end is not None)
    if isinstance(index, ast.List | ast.Tuple):
        return any(map(_numbered, index.elts))
    if isinstance(index, ast.UnaryOp):
        return _numbered(index.operand)
    return isinstance(index, ast.Constant) and type(index.value) is int


def _longest(house: House, size: Callable[[Function], int]) -> str:
    name, function = max(house.functions(), key=lambda pair: size(pair[1]))
    return f"{size(function)} (`{name.removeprefix(PACKAGE + '.')}`)"


def _longest_file(house: House) -> str:
    file = max(house.files, key=lambda file: file.lines)
    return f"{file.lines} (`{file.path.relative_to(house.root)}`)"


ROWS: dict[str, Callable[[House], object]] = {
    "parameters of `pw.fit`": House.public_fit,
    "longest signature, parameters": lambda house: _longest(house, parameters),
    "longest function, lines": lambda house: _longest(house, lines),
    "isinstance tests on kinds of field": lambda house: len(house.field_tests()),
    "class patterns of kinds of field": lambda house: len(house.field_patterns()),
    "imports of our own inside functions": lambda house: len(house.lazy_imports()),
    "files in a cycle within a room": lambda house: len(house.files_in_cycles()),
    "Levenberg-Marquardt loops in Python": lambda house: len(house.damping_loops()),
    "columns of parameter rows by number": lambda house: len(house.written_columns()),
    "files": lambda house: len(house.files),
    "lines of the median file": lambda house: f"{statistics.median(file.lines for file in house.files):.0f}",
    "longest file, lines": _longest_file,
}
PLACES: dict[str, Callable[[House], list[str]]] = {
    "Tests on kinds of field": House.field_tests,
    "Imports inside functions": House.lazy_imports,
    "Files in cycles": House.files_in_cycles,
    "Levenberg-Marquardt loops": House.damping_loops,
    "Columns by number": House.written_columns,
}


def main() -> None:
    summary, _, definitions = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=definitions, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("columns", metavar="NAME=TREE", nargs="+", help="a column of the table")
    parser.add_argument("--output", type=Path, help="where the table goes (Markdown; default: printed)")
    parser.add_argument("--places", action="store_true", help="print where the last column's counts are from")
    arguments = parser.parse_args()
    columns = [text.partition("=")[::2] for text in arguments.columns]
    houses = {name: House(Path(tree)) for name, tree in columns}
    rows = dict(ROWS)
    if shutil.which("duplicates"):
        rows["duplicates, pairs of places"] = House.duplicates
    command = " ".join(["python benchmarks/house.py", *(f"{name}=TREE" for name in houses)])
    table = [
        f"# The house in numbers\n\n`{command}`; what is counted, and how, is said in the script.\n",
        "| " + " | ".join(["", *houses]) + " |",
        "|---" * (len(houses) + 1) + "|",
        *(
            "| " + " | ".join([row, *(str(of(h)) for h in houses.values())]) + " |"
            for row, of in rows.items()
        ),
    ]
    text = "\n".join(table) + "\n"
    if arguments.output:
        arguments.output.write_text(text)
    print(text)
    if arguments.places:
        for title, of in PLACES.items():
            print(f"{title}:", *of(list(houses.values())[-1]), sep="\n  ")


if __name__ == "__main__":
    main()
