"""The order of the site's pages, by readers."""
import fnmatch

# A page is where its name stands, or else in the first section with a pattern that it matches; what
# matches none is in "More".
SECTIONS = {
    "Start": ["README.md", "docs/user/tutorial.md", "docs/gallery/README.md",
              "docs/gallery/*.md", "docs/user/faq.md", "docs/user/comparison.md"],
    "Use": ["docs/user/page.md", "docs/user/command-line.md", "docs/user/formats.md",
            "docs/user/hosts.md"],
    "Program": ["docs/user/api.md", "reference/rest.md", "reference/stream.md",
                "docs/design/wire-format.md", "clients/*/README.md", "reference/cpp.md",
                "docs/user/*.md"],
    "Operate": ["docs/user/deployment.md", "docs/user/deploy/*.md",
                "docs/user/configuration.md", "docs/user/metrics.md", "SECURITY.md"],
    "Accuracy and speed": ["docs/benchmarks/README.md", "docs/benchmarks/*.md"],
    "Contribute": ["CONTRIBUTING.md", "ARCHITECTURE.md", "docs/design/overview.md",
                   "docs/design/*.md", "CHANGELOG.md"],
}
REST = "More"


def tree(titles):
    """mkdocs' `nav` of the pages, whose titles are given by path."""
    left = sorted(titles)
    named = {path for patterns in SECTIONS.values() for path in patterns}
    nav = []
    for section, patterns in [*SECTIONS.items(), (REST, ["*"])]:
        pages = []
        for pattern in patterns:
            found = [path for path in left if fnmatch.fnmatchcase(path, pattern)]
            # * matches / here; patterns name whole folders.
            found = [path for path in found if path == pattern or path not in named and
                     (pattern == "*" or path.count("/") == pattern.count("/"))]
            pages += found
            left = [path for path in left if path not in found]
        if pages:
            nav.append({section: [{titles[path]: path} for path in pages]})
    return nav
