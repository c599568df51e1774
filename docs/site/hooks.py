"""What MkDocs calls while it builds the site: pages that are made from the program, and equations."""

from effect_pages import effect_pages
from equations import to_mathml
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from option_pages import option_pages
from pictures import effect_picture

from wipx.effects.catalogue import kinds


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of options and effects; they exist during a build only."""
    for path, text in {**option_pages(), **effect_pages()}.items():
        files.append(File.generated(config, path, content=text))
        kind = path.removeprefix("reference/effects/").removesuffix(".md")
        if kind in kinds():
            files.append(File.generated(config, path.replace(".md", ".svg"), content=effect_picture(kind)))
    return files


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Give the generated pages their places below "Reference"."""
    reference = next(section["Reference"] for section in config.nav or [] if "Reference" in section)
    for title, pages in (("Options", option_pages()), ("Effects", effect_pages())):
        reference.append({title: sorted(pages, key=_index_first)})
    return config


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn LaTeX into MathML, which browsers draw without a script."""
    return to_mathml(html)


def _index_first(path: str) -> tuple[bool, str]:
    return not path.endswith("index.md"), path
