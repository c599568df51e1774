"""LaTeX to MathML: what `pymdownx.arithmatex` has marked becomes what a browser draws by itself."""

import re
from html import unescape

from latex2mathml.converter import convert

MARKED = re.compile(r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', flags=re.DOTALL)


def to_mathml(html: str) -> str:
    """The same page with MathML in the place of marked LaTeX."""
    return MARKED.sub(_equation, html)


def _equation(match: re.Match[str]) -> str:
    display = "block" if match["tag"] == "div" else "inline"
    mathml = convert(unescape(match["latex"]).strip(), display=display)
    return f'<div class="equation">{mathml}</div>' if display == "block" else mathml
