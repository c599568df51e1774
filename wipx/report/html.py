"""What all pages share: templates that escape all texts, and script, style and data inside the file.

The pages open anywhere, without a network.
"""

import base64
import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from wipx.report.numbers import compact, significant


def render(
    template: str, *, style: tuple[str, ...], script: tuple[str, ...], data: dict, content: Mapping[str, object]
) -> str:
    """The HTML of a page.

    Args:
        template: Its template, which extends `base.html`.
        style: Style sheets, in their order.
        script: Scripts, in their order; they find `data` and plotly.js. A page without scripts has neither.
        data: What the scripts draw; only what JSON can hold.
        content: What the template shows; every text is escaped.
    """
    environment = Environment(
        loader=PackageLoader("wipx.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"significant": significant, "compact": compact}
    return environment.get_template(template).render(
        style=Markup("".join(map(_source, style))),
        script=Markup("".join(map(_source, script))),
        plotly=Markup(_plotly() if script else ""),
        data=Markup(_json_in_html(data)),
        **content,
    )


def _json_in_html(data: dict) -> str:
    """JSON that cannot close the script element that contains it."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _source(name: str) -> str:
    return files("wipx.report").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    """Plotly.js for charts with two axes, compressed, in base64; the page unpacks it."""
    return base64.b64encode(files("wipx.report").joinpath("plotly", "plotly-cartesian.min.js.gz").read_bytes()).decode()
