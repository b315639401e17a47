"""Whether the numbers of a text stand in tables."""

import html
import re

#: Numbers as texts and tables write them; not the digits in names like C1, quadtree_o2 or N^2
NUMBER = re.compile(r"(?<![\w.^/-])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w/]|\.\d)", re.IGNORECASE)


def numbers_of(text):
    """All numbers of a text."""
    return NUMBER.findall(text)


def paragraphs_of(page):
    """[(text, names of its tables)] of the paragraphs of an HTML page that say which tables their numbers are of."""
    found = re.findall(r'<p data-table="([^"]+)">(.*?)</p>', page, re.DOTALL)
    return [(html.unescape(re.sub(r"<[^>]+>", "", text)), tables.split()) for tables, text in found]


def missing_numbers(text, paths):
    """Numbers of a text that none of the files has."""
    known = {number for path in paths for number in numbers_of(path.read_text(encoding="utf-8"))}
    return [number for number in numbers_of(text) if number not in known]
