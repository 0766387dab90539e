"""A study for people: one self-contained page of sentences, figures and tables, in the look of a case's report."""

from base64 import b64decode
from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

import glisson
from glisson.navigation.figures.picture import Picture


@dataclass(frozen=True)
class Table:
    """Cells as they are shown."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Page:
    """What a page shows, from top to bottom."""

    title: str
    lead: Sequence[str]
    figures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()


def page_as_html(page: Page) -> bytes:
    """The page as an HTML file (UTF-8) that needs nothing else, not even a network."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("glisson.studies"), PackageLoader("glisson.navigation")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = environment.get_template("study.html.jinja").render(page=page, version=glisson.__version__)
    return text.encode()


def png(shown: Picture) -> bytes:
    """A figure as a file."""
    return b64decode(shown.source.partition(",")[2])


def number(value: float | None, digits: int = 2) -> str:
    """A number for people, or a dash."""
    return "–" if value is None else f"{value:.{digits}f}"
