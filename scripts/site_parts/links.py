"""Checks a built site: everything that pages refer to exists in it, with the anchor, and nothing
but links for readers leads to other hosts."""
import html.parser
import re
import urllib.parse

# Elements that a browser loads by itself; an <a> is followed by readers.
LOADED = {("link", "href"), ("script", "src"), ("img", "src"), ("img", "srcset"),
          ("iframe", "src"), ("source", "src"), ("video", "src"), ("video", "poster"),
          ("object", "data"), ("embed", "src"), ("form", "action")}
FOLLOWED = {("a", "href"), ("area", "href")}
CSS_URL = re.compile(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)")
NOT_LOADED = {"canonical", "prev", "next"}  # relations of <link>


class Page(html.parser.HTMLParser):
    """The anchors and references of a page: (address, line, whether a browser loads it)."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.references = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        if tag == "link" and given.get("rel") in NOT_LOADED:
            return
        for key, value in given.items():
            if value is not None and (tag, key) in LOADED | FOLLOWED:
                self.references.append((value, self.getpos()[0], (tag, key) in LOADED))
            if key == "style":
                self.references += [(one, self.getpos()[0], True) for one in urls_of(value or "")]


def urls_of(css):
    return [first or second for first, second in CSS_URL.findall(css)]


def complaint_about(site, path, reference, anchors):
    """Why the reference (address, line, loaded) of the file at `path` is wrong; None if it is
    right. `anchors`: of the pages, by path."""
    address, line, loaded = reference
    parts = urllib.parse.urlsplit(address)
    where = f"{path.relative_to(site)}:{line}: {address}"
    if parts.scheme in ("data", "javascript"):
        return None
    if parts.scheme or parts.netloc:
        return f"{where} is loaded from another host" if loaded else None
    if parts.path.startswith("/"):
        return f"{where} depends on the place of the site"
    target = path.parent / urllib.parse.unquote(parts.path) if parts.path else path
    target = target.resolve()
    if target.is_dir():
        target /= "index.html"
    if not target.is_file() or not target.is_relative_to(site):
        return f"{where} leads nowhere"
    anchor = urllib.parse.unquote(parts.fragment)
    if anchor and target in anchors and anchor not in anchors[target]:
        return f"{where}: the page has no such anchor"
    return None


def check(site):
    """The complaints about the site in the folder `site`, in the order of its files."""
    site = site.resolve()
    pages = {path: Page(path.read_text(errors="replace")) for path in sorted(site.rglob("*.html"))}
    anchors = {path: page.anchors for path, page in pages.items()}
    found = {path: page.references for path, page in pages.items()}
    for path in sorted(site.rglob("*.css")):
        found[path] = [(url, 1, True) for url in urls_of(path.read_text(errors="replace"))]
    return [complaint for path, references in found.items() for reference in references
            if (complaint := complaint_about(site, path, reference, anchors))]
