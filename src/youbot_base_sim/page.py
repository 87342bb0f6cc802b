"""The report of `analyse` as one HTML file that loads nothing: text to select, figures within."""
import base64
from html import escape

from .command_line import printable

HEAD = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>analyse</title>
<style>
body { max-width: 60em; margin: auto; padding: 0 1em; font: 16px/1.4 sans-serif; color: black; background: white }
th { padding-right: 1em; font-weight: normal; text-align: left; vertical-align: top; white-space: nowrap }
td { font-family: monospace; white-space: pre-wrap }
div { overflow-x: auto }
img { width: 100%; min-width: 40em }
@media (max-width: 45em) { th, td { display: block } td { font-size: 12px } }
</style>
"""


def article(title, sections):
    """The report of a bag. sections: (title, lines as in Section, a PNG or None)."""
    parts = [f"<h1>{text_of(title)}</h1>"]
    for heading, lines, picture in sections:
        rows = (f"<tr><th>{text_of(what)}</th><td>{text_of(text)}</td></tr>" if text else
                f'<tr><td colspan="2">{text_of(what)}</td></tr>' for what, text in lines)
        parts += [f"<h2>{text_of(heading)}</h2>", "<table>", *rows, "</table>"]
        if picture:
            parts.append(f'<div><img alt="{text_of(heading)}" src="data:image/png;base64,'
                         f'{base64.b64encode(picture).decode()}"></div>')
    return "\n".join(parts) + "\n"


def text_of(text):
    return escape(printable(str(text)))
