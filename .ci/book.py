"""The two steps of .ci/book that mdBook does not do.

book.py sources FOLDER    copies docs/ to FOLDER/docs for mdBook: decisions join the summary, and links that leave docs/ lead to SOURCE_URL
book.py links SITE        names every link in the built SITE whose file or anchor is missing, and ends with 1 if there is one
"""
import html.parser
import os
import pathlib
import re
import shutil
import sys
import urllib.parse

LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")


def title(page):
    return page.read_text().splitlines()[0].lstrip("# ")


def sources(out):
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree("docs", out / "docs")
    shutil.copy("book.toml", out)
    decisions = sorted((out / "docs/decisions").glob("[0-9]*.md"))
    with open(out / "docs/SUMMARY.md", "a") as summary:
        summary.writelines(f"  - [{title(page)}](decisions/{page.name})\n" for page in decisions)
    root, url = (out / "docs").resolve(), os.environ.get("SOURCE_URL", "").rstrip("/")
    for page in root.rglob("*.md"):

        def within(link, page=page):
            image, text, target = link.groups()
            path = target.split("#")[0]
            if not path or "://" in target or (page.parent / path).resolve().is_relative_to(root):
                return link[0]
            beside = os.path.relpath((page.parent / path).resolve(), root.parent)
            return f"{image}[{text}]({url}/{beside})" if url else text

        page.write_text(LINK.sub(within, page.read_text()))


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("id", "name"):
                self.anchors.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def links(site):
    site = site.resolve()
    pages = {path: Page(path) for path in site.rglob("*.html")}
    checked, dead = 0, []
    for path, page in pages.items():
        if path.name in ("404.html", "toc.html"):
            continue
        for link in page.links:
            url = urllib.parse.urlsplit(link)
            if url.scheme or url.netloc:
                continue
            checked += 1
            target = (path.parent / urllib.parse.unquote(url.path)).resolve() if url.path else path
            anchor = urllib.parse.unquote(url.fragment)
            if target.is_dir():
                target /= "index.html"
            found = target.exists() and (not anchor or target not in pages or anchor in pages[target].anchors)
            if not found:
                dead.append(f"{path.relative_to(site)}: {link}")
    for line in sorted(set(dead)):
        print("dead link:", line)
    print(f"book: {len(pages)} pages, {checked} links, {len(dead)} dead")
    return bool(dead) or not checked


if __name__ == "__main__":
    step, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    sys.exit(sources(folder) if step == "sources" else links(folder))
