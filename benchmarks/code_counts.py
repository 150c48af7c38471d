"""Counts of the source tree: layout, import arrows, lines, and the language of docstrings and names.

python -m benchmarks.code_counts [CHECKOUT] [-o benchmarks/results/code_counts.md]

CHECKOUT is the root of a checkout, by default this one. A sentence ends at ".", "!", "?", ";" or ":" before
white space, or at an empty line; docstrings are all string statements, those of constants included.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.common.tables import Table, write_text
from cagefield.errors import CagefieldError

BRITISH = re.compile(
    r"colour|centre|grey|neighbour|behaviour|licence"
    r"|(raster|vector|quant|normal|initial|real|voxel|serial|optim|minim|maxim|regular|summar|local|linear)"
    r"is(e|ed|er|es|ing|ation)"
)
"""British spellings in identifiers of lower case."""

FIRST_WORDS = re.compile(r"\s*(What|That|Those|The same)\b")


@dataclass(frozen=True)
class Docstring:
    """A docstring with its module and line."""

    module: str
    line: int
    text: str

    @property
    def sentences(self) -> list[str]:
        """Sentences of the docstring, white space included."""
        return [part for part in re.split(r"[.!?;:]\s+|\n\s*\n", self.text) if part.strip()]


@dataclass(frozen=True)
class SourceTree:
    """Syntax trees of a package's modules, by their dotted names."""

    modules: dict[str, ast.Module]
    package: str

    @classmethod
    def parse(cls, folder: Path) -> SourceTree:
        """Tree of the package in `folder`. Raises CagefieldError where there is none."""
        if not (folder / "__init__.py").is_file():
            raise CagefieldError(f"{folder} is no Python package; give the root of a checkout")
        modules = {}
        for path in sorted(folder.rglob("*.py")):
            parts = path.relative_to(folder.parent).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            modules[name] = ast.parse(path.read_text(encoding="utf-8"))
        return cls(modules, folder.name)

    def docstrings(self) -> Iterator[Docstring]:
        """All string statements: docstrings of modules, classes, functions, constants and fields."""
        for module, tree in self.modules.items():
            for node in ast.walk(tree):
                body = getattr(node, "body", None)
                for statement in body if isinstance(body, list) else ():
                    value = statement.value if isinstance(statement, ast.Expr) else None
                    if isinstance(value, ast.Constant) and isinstance(value.value, str):
                        yield Docstring(module, statement.lineno, value.value)

    def imports(self) -> dict[str, set[str]]:
        """Modules of the package that each module imports."""
        arrows: dict[str, set[str]] = {}
        for module, tree in self.modules.items():
            arrows[module] = set()
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == self.package:
                    for alias in node.names:
                        name = f"{node.module}.{alias.name}"
                        arrows[module].add(name if name in self.modules else str(node.module))
        return arrows

    def room(self, module: str) -> str:
        """First part of a module's name below the package."""
        return [*module.split("."), ""][1]

    def room_arrows(self) -> set[tuple[str, str]]:
        """Pairs of packages and loose modules, the first of which imports the second."""
        return {
            (self.room(module), self.room(other))
            for module, others in self.imports().items()
            for other in others
            if self.room(module) != self.room(other) and self.room(module) and self.room(other)
        }

    def functions(self) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
        """Functions and methods with their modules."""
        for module, tree in self.modules.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    yield module, node

    def constants(self) -> Iterator[tuple[str, str, str]]:
        """(module, name, value as text) of constants in capitals."""
        for module, tree in self.modules.items():
            for node in tree.body:
                targets = node.targets if isinstance(node, ast.Assign) else ()
                if isinstance(node, ast.AnnAssign) and node.value is not None:
                    targets = [node.target]
                for target in targets:
                    if isinstance(target, ast.Name) and re.fullmatch(r"[A-Z][A-Z0-9_]*", target.id):
                        yield module, target.id, ast.unparse(node.value)  # type: ignore[union-attr, arg-type]

    def identifiers(self) -> Iterator[tuple[str, str]]:
        """(module, name) of definitions: functions, classes, arguments, assigned names."""
        for module, tree in self.modules.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                    yield module, node.name
                elif isinstance(node, ast.arg):
                    yield module, node.arg
                elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    yield module, node.id


def what_sentences(tree: SourceTree) -> tuple[int, Counter[str]]:
    """(number of docstring sentences, sentences with the word "what" by module)."""
    total, found = 0, Counter[str]()
    for docstring in tree.docstrings():
        for sentence in docstring.sentences:
            total += 1
            found[docstring.module] += bool(re.search(r"\bwhat\b", sentence, re.IGNORECASE))
    return total, found


def pronoun_starts(tree: SourceTree) -> Counter[str]:
    """Sentences that begin with "What", "That", "Those" or "The same", by module."""
    return Counter(
        docstring.module
        for docstring in tree.docstrings()
        for sentence in docstring.sentences
        if FIRST_WORDS.match(sentence)
    )


def functions_called_of(tree: SourceTree) -> Counter[str]:
    """Functions and methods called `of`, by module."""
    return Counter(module for module, function in tree.functions() if function.name == "of")


def shared_constant_names(tree: SourceTree) -> dict[str, set[str]]:
    """Names of constants with different values in different modules, and these values."""
    values: dict[str, set[str]] = defaultdict(set)
    for _, name, value in tree.constants():
        values[name.lstrip("_")].add(value)
    return {name: found for name, found in values.items() if len(found) > 1}


def british_identifiers(tree: SourceTree) -> Counter[str]:
    """Definitions in British spelling, by module."""
    return Counter(module for module, name in tree.identifiers() if BRITISH.search(name.lower()))


def longest_signatures(tree: SourceTree, count: int = 10) -> list[tuple[int, str]]:
    """(number of parameters, module and function) of the longest signatures.

    The rows [begin, end) of `compute.parallel_kernels` are left out: no caller passes them.
    """
    sizes = [
        (
            len({a.arg for a in (*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs)} - {"begin", "end"}),
            f"{module}.{f.name}",
        )
        for module, f in tree.functions()
    ]
    return sorted(sizes, reverse=True)[:count]


def line_count(folder: Path, pattern: str) -> int:
    """Lines of the files below a folder, without those of dependencies."""
    return sum(
        len(path.read_text(encoding="utf-8", errors="replace").splitlines())
        for path in folder.rglob(pattern)
        if "node_modules" not in path.parts
    )


def counts(checkout: Path) -> list[tuple[str, str]]:
    """(count, value) rows of a checkout."""
    package = checkout / "src" / "cagefield"
    tree = SourceTree.parse(package)
    packages = [path for path in package.iterdir() if (path / "__init__.py").is_file()]
    loose = [path for path in package.glob("*.py") if path.name not in ("__init__.py", "__main__.py")]
    modules = sum(len(others) for others in tree.imports().values())
    total, found = what_sentences(tree)
    share = 100 * found.total() / total
    rows = [
        ("packages in `src/cagefield`", f"{len(packages)}"),
        ("loose modules beside them", f"{len(loose)}"),
        ("modules", f"{len(tree.modules)}"),
        ("arrows between packages", f"{len(tree.room_arrows())}"),
        ("imports between modules", f"{modules}"),
        ("lines of `src`", f"{line_count(package, '*.py')}"),
        ("lines of `tests`", f"{line_count(checkout / 'tests', '*.py')}"),
        ("lines of `benchmarks`", f"{line_count(checkout / 'benchmarks', '*.py')}"),
        ("lines of `web`", f"{line_count(checkout / 'web', '*.ts')}"),
        ("docstring sentences", f"{total}"),
        ('docstring sentences with "what"', f"{found.total()} ({share:.1f} %)"),
        (
            'docstring sentences that begin "What", "That", "Those", "The same"',
            f"{pronoun_starts(tree).total()}",
        ),
        ("functions called `of`", f"{functions_called_of(tree).total()}"),
        ("names of constants with several values", f"{len(shared_constant_names(tree))}"),
        ("definitions in British spelling", f"{british_identifiers(tree).total()}"),
    ]
    signatures = [(f"parameters of `{name}`", f"{size}") for size, name in longest_signatures(tree)]
    return [*rows, *signatures]


@dataclass
class CodeCounts:
    """Count packages, arrows, lines and words of a checkout."""

    checkout: tyro.conf.Positional[Path] = Path(__file__).parents[1]
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table."""
        table = Table("Counts of the source tree", ("count", "value"), tuple(counts(self.checkout)))
        table.show()
        if self.out is not None:
            write_text(self.out, table.markdown())


if __name__ == "__main__":
    try:
        tyro.cli(CodeCounts).run()
    except CagefieldError as error:
        sys.exit(f"error: {error}")
