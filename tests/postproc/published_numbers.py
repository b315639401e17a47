"""Whether the numbers of a text stand in tables, and whether a published page says what its tables say."""

import csv
import html
import re

#: Numbers as texts and tables write them; not the digits in names like C1, quadtree_o2 or N^2
NUMBER = re.compile(r"(?<![\w.^/-])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w/]|\.\d)", re.IGNORECASE)

#: How pages and tables name the revision that made their numbers
REVISION = re.compile(r"(?:revision|git|with|polydem [\d.]+ \(revision)[:\s]+([0-9a-f]{7,40})\b", re.IGNORECASE)


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


def rows_of(path):
    """The rows of a published table."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def claims_of(page):
    """Rows of the table of claims in a page."""
    lines = [line for line in page.splitlines() if re.match(r"\| (claim|C\d+[a-z]?) \|", line)]
    heading, *rows = ([cell.strip() for cell in line.strip("|").split(" | ")] for line in lines)
    return [dict(zip(heading, row)) for row in rows]


def disagreements(folder):
    """What the page of a folder says otherwise than the tables beside it."""
    page = (folder / "README.md").read_text(encoding="utf-8")
    tables = folder / "tables"
    claims, reasons = rows_of(tables / "claims.csv"), {row["claim"]: row for row in rows_of(tables / "reasons.csv")}
    found = [f"row of {row['claim']}" for row, said in zip(claims, claims_of(page), strict=True) if row != said]
    for row in claims:
        if row["claim"] not in reasons:  # a part of the claim above
            continue
        reason = reasons[row["claim"]]["reason"]
        said = f"* **{row['claim']}** {row['says']}. *Rule:* {reasons[row['claim']]['rule']}. " \
               f"*Verdict:* {row['verdict']}. {'' if reason == '-' else reason}".rstrip()
        if said not in page.splitlines():
            found.append(f"reason of {row['claim']}")
    listed = set(re.findall(r"\]\(tables/(\w+\.csv)\)", page))
    found += [f"table {name}" for name in listed ^ {path.name for path in tables.glob("*.csv")}]
    shown = set(re.findall(r"!\[[^]]*\]\(([\w.]+\.png)\)", page))
    found += [f"figure {name}" for name in shown ^ {path.name for path in folder.glob("*.png")}]
    revisions = set(REVISION.findall((tables / "revision.txt").read_text(encoding="utf-8")))
    found += [f"revision {name}" for name in revisions if name not in page]
    return found
