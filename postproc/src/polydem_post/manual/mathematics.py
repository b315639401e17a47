"""Equations of the pages: LaTeX between dollars or in a block `math` becomes MathML, which browsers draw."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

from latex2mathml.converter import convert
from markdown import Extension, Markdown
from markdown.inlinepatterns import InlineProcessor

#: LaTeX between dollars, as GitHub reads it: no blank inside, no word outside
INLINE = r"(?<![\w$\\])\$(?=[^\s$])([^$]*?)(?<=[^\s$])\$(?![\w$])"

#: Above escapes, so that a backslash is left to LaTeX, and below code
PRIORITY = 185


class _InlineEquation(InlineProcessor):
    """An equation within a line."""

    def handleMatch(self, found: Any, _: str) -> tuple[Element | str, int, int]:  # noqa: N802
        """Replace an equation; Python-Markdown gives this name."""
        return self.md.htmlStash.store(convert(found.group(1))), found.start(0), found.end(0)


class Mathematics(Extension):
    """Extension of Markdown for equations within a line."""

    def extendMarkdown(self, md: Markdown) -> None:  # noqa: N802
        """Add the pattern; Python-Markdown gives this name."""
        md.inlinePatterns.register(_InlineEquation(INLINE, md), "equation", PRIORITY)


def makeExtension(**options: Any) -> Mathematics:  # noqa: N802
    """Make the extension; Python-Markdown gives this name."""
    return Mathematics(**options)


def draw_block(source: str, *_: Any, **__: Any) -> str:
    """MathML of a block of equations, one per paragraph."""
    parts = [part.replace("\n", " ").strip() for part in source.split("\n\n")]
    return "".join(f'<p class="equation">{convert(part, display="block")}</p>' for part in parts if part)
