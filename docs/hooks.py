"""Pages of the site outside `docs`: tables of benchmarks, contributing, releasing, the changelog."""

from __future__ import annotations

from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
OUTSIDE = (
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "RELEASING.md",
    "benchmarks/README.md",
    "benchmarks/results/*.md",
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The pages of `docs`, and those outside it under their paths from the root."""
    for pattern in OUTSIDE:
        for page in sorted(ROOT.glob(pattern)):
            files.append(File.generated(config, page.relative_to(ROOT).as_posix(), abs_src_path=str(page)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """The page's text: on the site, `docs` is the root."""
    if page.file.generated_by is not None:
        markdown = markdown.replace("](docs/", "](").replace("](../docs/", "](../")
    return markdown
