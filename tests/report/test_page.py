"""The page, complete in itself."""

from __future__ import annotations

from html.parser import HTMLParser

import pytest

from ulna.base import FormulaError
from ulna.plot import Curve, plot_curves, svg_text
from ulna.report import (
    Badge,
    Block,
    Card,
    Document,
    Fold,
    Formula,
    Frame,
    Link,
    Picture,
    Row,
    Section,
    Table,
    Text,
    Tone,
    render_page,
)


class _Reader(HTMLParser):
    """Notes every attribute, identifier and unbalanced element of a page."""

    VOID = frozenset({"meta", "br", "link", "img"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.identifiers: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self.identifiers += [value or "" for name, value in attrs if name == "id"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def _document(*blocks: Block) -> Document:
    return Document(
        title="A <title>",
        lead="With $x_1 < 2$ & more",
        facts=(("54", "equations", Tone.PLAIN),),
        sections=(Section(anchor="first", title="First", blocks=blocks),),
    )


def _full() -> Document:
    picture = svg_text(
        plot_curves([Curve(label="a", times=[0, 1], values=[0, 1])], quantity="θ", unit="rad"), prefix="a-"
    )
    table = Table(
        head=("name", "$k$", "verdict", "where"),
        rows=(("<b>", "128", Badge(text="agrees", tone=Tone.GOOD), Link(text="(1)", anchor="eq-1")),),
        caption="Gains",
        numeric=frozenset({1}),
    )
    card = Card(
        anchor="eq-1",
        label="(1)",
        title="One",
        badges=(Badge(text="misprint", tone=Tone.BAD),),
        blocks=(Formula(latex=r"\frac{1}{2}", caption="printed"), Fold(title="more", blocks=(Text(text="hidden"),))),
    )
    return _document(
        Row(blocks=(Picture(svg=picture, caption="$x$", description="a ramp"), Text(text="a"))), table, card
    )


def _read(page: str) -> _Reader:
    reader = _Reader()
    reader.feed(page)
    assert reader.open == []
    return reader


def test_every_element_is_closed_and_every_identifier_is_there_once() -> None:
    reader = _read(render_page(_full()))
    assert len(reader.identifiers) == len(set(reader.identifiers))


def test_every_link_leads_to_a_place_on_the_page() -> None:
    reader = _read(render_page(_full()))
    links = {value for tag, name, value in reader.attributes if tag == "a" and name == "href"}
    assert links == {"#content", "#first", "#eq-1"}
    assert {link[1:] for link in links} <= set(reader.identifiers)


def test_the_page_needs_no_network_no_script_and_no_second_file() -> None:
    reader = _read(render_page(_full()))
    assert not {"script", "link", "img", "iframe", "object"} & reader.tags
    outside = [
        value for _, name, value in reader.attributes if name in {"src", "href", "xlink:href"} and value[:1] != "#"
    ]
    assert outside == []
    assert "@import" not in render_page(_full())


def test_its_policy_allows_the_scripts_of_pages_inside_it_and_no_other() -> None:
    assert "script-src &#39;none&#39;;" in render_page(_full())
    policy = "script-src &#39;sha256-a+b=&#39; 'sha256-c='; style-src 'x'"
    inner = f"<meta content=\"{policy}\"><title>script-src 'evil';</title>"
    reader = _read(render_page(_document(Fold(title="more", blocks=(Frame(html=inner, title="a & 'b'"),)))))
    (policy,) = (v for tag, name, v in reader.attributes if tag == "meta" and name == "content" and "script-src" in v)
    assert "script-src 'sha256-a+b=' 'sha256-c=';" in policy
    assert policy.startswith("default-src 'none'; ")
    assert ("iframe", "srcdoc", inner) in reader.attributes


def test_a_wide_table_can_be_reached_by_keys() -> None:
    assert '<div class="table-frame" tabindex="0" role="region" aria-label="Gains">' in render_page(_full())


def test_texts_are_escaped_and_formulas_are_set() -> None:
    page = render_page(_full())
    assert "<h1>A &lt;title&gt;</h1>" in page
    assert "<td>&lt;b&gt;</td>" in page
    assert "<mo>&lt;</mo><mn>2</mn>" in page
    assert "<mfrac><mn>1</mn><mn>2</mn></mfrac>" in page


def test_a_judgement_is_said_without_colour_too() -> None:
    page = render_page(_full())
    assert ">✓</span> agrees" in page
    assert ">✗</span> misprint" in page


def test_the_same_document_gives_the_same_page() -> None:
    assert render_page(_full()) == render_page(_full())


def test_a_formula_that_cannot_be_set_is_an_error_not_a_blank() -> None:
    with pytest.raises(FormulaError, match="nonsense"):
        render_page(_document(Formula(latex=r"\nonsense")))


def test_a_row_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match="2 cells in a table of 1 columns"):
        Table(head=("a",), rows=(("1", "2"),))
