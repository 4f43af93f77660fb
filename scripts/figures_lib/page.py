"""Writes index.html: all figures that were made, with the report's words beside ours, and links to their files."""

import html
import re

from . import registry
from .work import write_atomically

CHAPTERS = {
    "2": "Chapter 2: Literature",
    "3": "Chapter 3: Requirements and analysis",
    "5": "Chapter 5: Implementation",
    "6": "Chapter 6: Results",
}
STYLE = """
:root { color-scheme: light dark; --paper: #fbfbfa; --ink: #22262a; --soft: #5d656c; --line: #d8dcdf; --card: #ffffff;
  --report: #b04a22; --ours: #1a638f; --good: #e3f2e6; --bad: #fbe4dc; }
@media (prefers-color-scheme: dark) { :root { --paper: #16191c; --ink: #e4e7e9; --soft: #9aa3aa; --line: #343a3f;
  --card: #1d2125; --report: #ec9770; --ours: #79bbe2; --good: #1f3a28; --bad: #46271d; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main, header { max-width: 1460px; margin: 0 auto; padding: 0 24px; }
h1 { font-size: 1.9rem; margin: 36px 0 8px; } h2 { margin: 56px 0 0; font-size: 1.35rem; }
h3 { margin: 0 0 10px; font-size: 1.1rem; } p { margin: 6px 0; } a { color: var(--ours); }
nav { font-size: .88rem; line-height: 1.9; margin: 14px 0; } nav b { display: inline-block; min-width: 6.5em; }
nav a { margin-right: .9em; white-space: nowrap; text-decoration: none; }
section { border-top: 1px solid var(--line); margin-top: 26px; padding-top: 20px; }
.sides { display: grid; grid-template-columns: 1fr 1fr; gap: 8px 32px; max-width: 1100px; }
.sides b { display: block; font-size: .8rem; letter-spacing: .06em; text-transform: uppercase; }
.report b { color: var(--report); } .ours b { color: var(--ours); }
.why { max-width: 1100px; color: var(--soft); } .why b { color: var(--ink); font-weight: 600; }
figure { margin: 14px 0; break-inside: avoid; }
figure img { display: block; max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line);
  border-radius: 6px; padding: 8px; }
figcaption, caption { font-size: .88rem; color: var(--soft); text-align: left; padding: 4px 0; }
.wide { overflow-x: auto; } table { border-collapse: collapse; margin: 12px 0; font-size: .92rem; }
th, td { padding: 4px 14px 4px 0; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
th { font-weight: 600; color: var(--soft); vertical-align: bottom; white-space: normal; max-width: 9em; }
td.text, th.text { text-align: left; } td.good { background: var(--good); } td.bad { background: var(--bad); }
details { font-size: .85rem; color: var(--soft); } summary { cursor: pointer; }
pre { overflow-x: auto; background: var(--card); border: 1px solid var(--line); padding: 8px; border-radius: 6px; }
@media screen and (max-width: 760px) { .sides { grid-template-columns: 1fr; } }
@page { size: A4; margin: 14mm; }
@media print { :root { --paper: #fff; --ink: #000; --soft: #444; --line: #ccc; --card: #fff; --report: #9c3d17;
    --ours: #14527a; --good: #e3f2e6; --bad: #fbe4dc; color-scheme: light; }
  body { font-size: 10pt; } main, header { padding: 0; max-width: none; } nav, details { display: none; }
  h2, h3, .sides, .why { break-after: avoid; break-inside: avoid; } section { margin-top: 14px; padding-top: 10px; }
  .wide { overflow: visible; } th { max-width: 7em; }
  figure img { border: 0; padding: 0; max-height: 225mm; } table { font-size: 8pt; break-inside: avoid; }
  td, th { -webkit-print-color-adjust: exact; print-color-adjust: exact; padding-right: 7px; } }
"""


def to_html(text):
    """Returns text as HTML, with `code` as an element."""
    text = html.escape(text, quote=False)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def label(name):
    """Returns "Figure 6.1" for "fig6.1"."""
    kind, number = re.match(r"([a-z]+)(.*)", name).groups()
    return {"fig": "Figure", "table": "Table", "graph": "Graph"}[kind] + " " + number


def is_number(cell):
    return re.fullmatch(r"[-+−]?[\d.,]+ ?%?|–", cell) is not None


def table(block):
    columns = range(len(block["head"]))
    text = [any(not is_number(row[j]) for row in block["rows"]) for j in columns]
    rows = [
        "<tr>" + "".join(f'<th class="{"text" if text[j] else ""}">{to_html(block["head"][j])}</th>' for j in columns)
    ]
    for i, row in enumerate(block["rows"]):
        cells = []
        for j in columns:
            mark = block["marks"][i][j] if "marks" in block else ""
            cells.append(f'<td class="{"text" if text[j] else ""} {mark}">{to_html(row[j])}</td>')
        rows.append("<tr>" + "".join(cells))
    caption = f"<caption>{to_html(block['caption'])}</caption>" if block["caption"] else ""
    return f'<div class="wide"><table>{caption}{"".join(rows)}</table></div>'


def picture(block, alt):
    source = block.get("svg", block["png"])
    caption = f"<figcaption>{to_html(block['caption'])}</figcaption>" if block["caption"] else ""
    img = f'<img src="{source}" width="{block["width"] + 18}" alt="{html.escape(alt)}" loading="lazy">'
    return f'<figure><a href="{source}">{img}</a>{caption}</figure>'


def section(figure, stamp):
    """Returns the HTML of a figure from its stamp."""
    out = [f'<section id="{figure.name}"><h3>{label(figure.name)}. {to_html(figure.title)}</h3><div class="sides">']
    out.append(f'<div class="report"><b>The report</b>{to_html(figure.report)}</div>')
    out.append(f'<div class="ours"><b>Here</b>{to_html(stamp["ours"])}</div></div>')
    if stamp["why"]:
        out.append(f'<p class="why"><b>What differs, and why.</b> {to_html(stamp["why"])}</p>')
    for block in stamp["blocks"]:
        if block["kind"] == "picture":
            out.append(picture(block, f"{label(figure.name)}: {figure.title}"))
        elif block["show"]:
            out.append(table(block))
    files = " ".join(f'<a href="{f}">{f}</a>' for f in stamp["files"])
    commands = html.escape("\n".join(stamp["commands"])) or "drawn by the script alone"
    out.append(
        f"<details><summary>Files and how they were made ({stamp['made']}, {stamp['seconds']:.1f} s, "
        f"{stamp['quality']})</summary><p>{files}</p><pre>{commands}</pre></details></section>"
    )
    return "".join(out)


def write(figure_run):
    """Writes the page and returns its path."""
    made = [(f, stamp) for f in registry.FIGURES if (stamp := figure_run.stamp_of(f)) is not None]
    chapter_of = {f.name: re.search(r"(\d+)\.", f.name).group(1) for f, _ in made}
    monkey = (
        "Suzanne is Blender's own."
        if figure_run.blender
        else "Blender is not installed here, so Suzanne's part is played by our monkey (scenes/models/monkey.obj)."
    )
    out = [
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">',
        f"<title>The figures of the 2010 report, again</title><style>{STYLE}</style><header>",
        "<h1>The figures of the 2010 report, again</h1>",
        (
            "<p>J. Gilbert, <i>Real Time Morphing of Polyhedra</i>, University of Sheffield, 2010: its figures, graphs"
            " and tables, made by its own method, which polymorph keeps selectable, and by polymorph's. Numbers called"
            " the report's are quoted from it; every other number was measured by the program, or computed, when its"
            f" figure was made. Models are this repository's, not the report's, so counts differ. {monkey}</p>"
        ),
        f"<p>Made by <code>scripts/figures</code> with {html.escape(figure_run.version)}.</p><nav>",
    ]
    for chapter, title in CHAPTERS.items():
        links = [f'<a href="#{f.name}">{label(f.name)}</a>' for f, _ in made if chapter_of[f.name] == chapter]
        if links:
            out.append(f"<div><b>Chapter {chapter}</b> {' '.join(links)}</div>")
    out.append("</nav></header><main>")
    for chapter, title in CHAPTERS.items():
        sections = [section(f, stamp) for f, stamp in made if chapter_of[f.name] == chapter]
        if sections:
            out += [f"<h2>{title}</h2>", *sections]
    out.append("</main></html>\n")
    index = figure_run.folder / "index.html"
    write_atomically(index, "\n".join(out))
    return index
