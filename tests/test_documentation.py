"""Documentation: snippets that the site includes, and the public names that its pages promise."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re
from html import unescape
from pathlib import Path

import pytest

import cagefield

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
REFERENCE = sorted((ROOT / "docs/reference").glob("*.md"))
SNIPPET = re.compile(r'^--8<-- "([^":]+)(?::(\w+))?"$', re.M)
PROMISED = re.compile(r"^::: ([\w.]+)$", re.M)
LINKED = re.compile(r"\]\[(cagefield[\w.]*)\]")


def rendered(page: str) -> str:
    """HTML text of a page, with the site's own Markdown extensions."""
    pytest.importorskip("mkdocs", reason="mkdocs is not installed (extra docs)")
    import markdown
    from mkdocs.config import load_config

    config = load_config(str(ROOT / "mkdocs.yml"))
    configs = {
        name: {**options, "base_path": [str(ROOT)]} if name == "pymdownx.snippets" else options
        for name, options in config["mdx_configs"].items()
    }
    html: str = markdown.markdown(
        (ROOT / page).read_text(encoding="utf-8"),
        extensions=config["markdown_extensions"],
        extension_configs=configs,
    )
    return html


def code_of(html: str) -> list[str]:
    """Text of the code blocks of a page, without the marks of the highlighter."""
    blocks = re.findall(r"<pre.*?>(.*?)</pre>", html, re.S)
    return [unescape(re.sub(r"<[^>]+>", "", block)) for block in blocks]


def test_another_field_shows_the_program_that_test_examples_runs() -> None:
    html = rendered("docs/how-to/another-field.md")
    assert "examples/own_field.py" in html
    shown = [code for code in code_of(html) if "class OwnField" in code]
    assert len(shown) == 1
    assert shown[0].strip() == (ROOT / "examples/own_field.py").read_text(encoding="utf-8").strip()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_snippets_are_included_as_written(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    marks = re.findall(r"^.*--8\s*<.*$", text, re.M)
    found = [match.group(0) for match in SNIPPET.finditer(text)]
    assert marks == found, "a formatter changed the mark of a snippet"
    for path, section in SNIPPET.findall(text):
        source = (ROOT / path).read_text(encoding="utf-8")
        assert not section or f"--8<-- [start:{section}]" in source


def test_formatter_leaves_markdown_alone() -> None:
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8").partition("[tool.ruff.format]")[2]
    assert 'exclude = ["*.md"]' in settings.partition("\n[")[0]


def resolved(name: str) -> object:
    """Object of a dotted name: the longest importable module, then its attributes.

    Raises ModuleNotFoundError where the module needs a package that is not installed.
    """
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError as error:
            if not (error.name or "").startswith("cagefield"):
                raise
            continue
        for part in parts[count:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


def lacks_torch(name: str) -> bool:
    """Whether a name needs PyTorch (extra nerf) and PyTorch is not installed."""
    return (".nerf." in name or ".torch_" in name) and importlib.util.find_spec("torch") is None


def promised_names() -> list[str]:
    """Dotted names of the reference, and of the links on all pages."""
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    return sorted(
        {name for text in texts for pattern in (PROMISED, LINKED) for name in pattern.findall(text)}
    )


@pytest.mark.parametrize("name", promised_names())
def test_promised_names_are_importable(name: str) -> None:
    if lacks_torch(name):
        pytest.skip("PyTorch is not installed (extra nerf)")
    found = resolved(name)
    assert inspect.isclass(found) or inspect.isfunction(found)
    assert found.__doc__, f"{name} has no docstring"


@pytest.mark.parametrize("page", REFERENCE, ids=lambda page: page.name)
def test_package_of_a_reference_page_exports_its_names(page: Path) -> None:
    """`cagefield.training.train_voxel` for `cagefield.training.voxels.train_voxels.train_voxel`."""
    for name in PROMISED.findall(page.read_text(encoding="utf-8")):
        package, leaf = ".".join(name.split(".")[:2]), name.rpartition(".")[2]
        if package == "cagefield.compute":
            continue  # used by the name of its module: `devices.start`
        module = importlib.import_module(package)
        assert leaf in dir(module), f"{package} does not list {leaf}"
        if lacks_torch(name):
            continue
        assert getattr(module, leaf, None) is resolved(name), f"{package} does not export {leaf}"


def test_names_of_the_index_are_exports_of_cagefield() -> None:
    table = (ROOT / "docs/reference/index.md").read_text(encoding="utf-8")
    names = re.findall(r"\[`(\w+)`\]\[([\w.]+)\]", table)
    assert {"Cage", "Scene", "VoxelRenderer"} <= {name for name, _ in names}
    for name, path in names:
        assert getattr(cagefield, name) is resolved(path)
    assert {name for name, _ in names} == set(cagefield.__all__) - {"__version__"}


def test_functions_of_python_page_are_exports() -> None:
    from cagefield import training

    text = (ROOT / "docs/how-to/python.md").read_text(encoding="utf-8")
    promised = set(re.findall(r"`(train_\w+)`", text.partition("## Training")[2]))
    assert promised == {"train_voxel", "train_splat", "train_nerf"}
    assert promised <= set(training.__all__)
    assert {inspect.isfunction(getattr(training, name)) for name in promised - {"train_nerf"}} == {True}
