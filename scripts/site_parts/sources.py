"""Gathers the documents of the repository for mkdocs: the same tree, with links that also lead to
what is not a document, and headings with the anchors that they have in the repository."""
import posixpath
import re
import shutil

import check_links

STARTS = ["*.md", "docs/**/*.md", "clients/*/README.md"]
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"(#{1,6}) +(.*)")
SHOWN_BYTES_MAX = 8 * 1024  # of a file that gets a page of its own
LANGUAGES = {".json": "json", ".py": "python", ".yaml": "yaml"}
NOT_SHOWN = {".svg", ".html"}  # browsers show them


class Broken(Exception):
    """A link of a document cannot be followed."""


def title_of(text, path):
    """The first heading, without its markup."""
    for _, line in check_links.prose(text):
        if match := HEADING.fullmatch(line.rstrip()):
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", match[2])
            return plain.replace("`", "").replace("*", "")
    return posixpath.basename(path)


def code_page(path, text):
    """A page that shows the file at `path`, whatever it contains, and leads to it."""
    name = posixpath.basename(path)
    fence = "`" * (1 + max([2, *(len(run) for run in re.findall("`+", text))]))
    language = LANGUAGES.get(posixpath.splitext(name)[1], "text")
    return (f"# {name}\n\nThe file `{path}` of the project ([download]({name})).\n\n"
            f"{fence}{language}\n{text.rstrip()}\n{fence}\n")


class Gatherer:
    """Copies documents and what they lead to from `root` to `target`."""

    def __init__(self, root, target):
        self.root, self.target = root, target
        self.titles = {}  # of the pages, by path
        self.waiting = []

    def add(self, path):
        if path not in self.titles and path not in self.waiting:
            self.waiting.append(path)

    def write(self, path, text):
        place = self.target / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)

    def run(self):
        while self.waiting:
            path = self.waiting.pop()
            text = (self.root / path).read_text()
            self.titles[path] = title_of(text, path)
            self.write(path, self.rewritten(path, text))

    def rewritten(self, path, text):
        """The document with the links and anchors of the site."""
        anchors = iter(check_links.anchors(text))
        lines = text.splitlines()
        for number, line in check_links.prose(text):
            new = LINK.sub(lambda link: f"]({self.link(path, number, link[1])})", line)
            if HEADING.fullmatch(new.rstrip()):
                new = f"{new.rstrip()} {{#{next(anchors)}}}"
            lines[number - 1] = new
        return "\n".join(lines) + "\n"

    def link(self, path, number, link):
        """The link in the site for one in line `number` of the document at `path`."""
        file, mark, anchor = link.partition("#")
        if re.match(r"[a-z]+:", link) or not file:
            return link
        place = posixpath.normpath(posixpath.join(posixpath.dirname(path), file))
        source = self.root / place
        if place.startswith("../") or not source.exists():
            raise Broken(f"{path}:{number}: {link} leads nowhere")
        if source.is_dir():
            if (source / "README.md").exists():
                self.add(f"{place}/README.md")
                return f"{file.rstrip('/')}/README.md{mark}{anchor}"
            self.write_listing(place)
            return f"{file.rstrip('/')}/index.md"
        if place.endswith(".md"):
            self.add(place)
            return link
        (self.target / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, self.target / place)
        return f"{file}.md" if self.has_page(source, place) else link

    def write_listing(self, place):
        """The page of a folder without a document: links to its files."""
        page = f"{place}/index.md"
        if (self.target / page).exists():
            return
        names = sorted(one.name for one in (self.root / place).iterdir()
                       if one.is_file() and not one.name.startswith("."))
        lines = [f"- [{name}]({self.link(page, 0, name)})" for name in names]
        heading = f"# {posixpath.basename(place)}\n\nThe files of the folder `{place}`:\n\n"
        self.write(page, heading + "\n".join(lines) + "\n")

    def has_page(self, source, place):
        """Whether the file gets a page that shows it, which is then written."""
        content = source.read_bytes()
        if source.suffix in NOT_SHOWN or b"\0" in content or len(content) > SHOWN_BYTES_MAX:
            return False
        try:
            self.write(f"{place}.md", code_page(place, content.decode()))
        except UnicodeDecodeError:
            return False
        return True


def gather(root, target):
    """Returns the titles of the documents by their paths. Raises Broken."""
    gatherer = Gatherer(root, target)
    for pattern in STARTS:
        for path in sorted(root.glob(pattern)):
            gatherer.add(path.relative_to(root).as_posix())
    gatherer.run()
    return gatherer.titles
