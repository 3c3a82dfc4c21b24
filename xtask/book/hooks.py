"""What mkdocs does for the book beside its own work: pages of reference made by the program itself, a list of papers and of log entries,
and links that lead out of the folder `docs`, which a reader of the built book does not have."""

import json
import os
import re
import subprocess
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
# What lets the search work in pages that are opened as files.
WORKER, FOREIGN_WORKER = "assets/iframe-worker.js", "https://unpkg.com/iframe-worker/shim"
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_config(config):
    """Every paper's page and every entry of the log stands in the table of contents."""
    nav = {name: entry[name] for entry in config.nav if isinstance(entry, dict) for name in entry}
    nav["Papers"] += sorted(f"papers/{p.name}" for p in (ROOT / "docs/papers").glob("*.md"))
    nav["Reference"] += ["book/reference/trackers.md", "book/reference/commands.md", "book/reference/studio.md"]
    logs = sorted((f"log/{p.name}" for p in (ROOT / "docs/log").glob("*.md")), reverse=True)
    config.nav.append({"Log": logs})
    return config


def on_files(files, config):
    """Adds what the program says of itself."""
    pages = {"trackers": trackers(), "commands": commands(), "studio": studio()}
    for name, text in pages.items():
        files.append(File.generated(config, f"book/reference/{name}.md", content=text))
    files.append(File.generated(config, WORKER, content=(ROOT / "xtask/book/iframe-worker.js").read_text()))
    return files


def on_post_page(output, page, config):
    """The search's helper comes from the book, not from a server."""
    return output.replace(FOREIGN_WORKER, "../" * page.url.count("/") + WORKER)


def on_post_template(output_content, template_name, config):
    """The same of pages that are no documents."""
    return output_content.replace(FOREIGN_WORKER, WORKER)


def on_page_markdown(markdown, page, config, files):
    """Of a link that leads out of `docs` only its words stay."""
    folder = Path(page.file.src_uri).parent

    def kept(match):
        mark, words, target = match.groups()
        if "://" in target or target.startswith(("#", "mailto:")):
            return match.group(0)
        path = os.path.normpath(folder / target.split("#")[0])
        is_page = files.get_file_from_path(Path(path).as_posix()) is not None
        if is_page:
            return match.group(0)
        inside = not path.startswith("..") and path != "log"
        return match.group(0) if inside else words

    return LINK.sub(kept, markdown)


def said(*arguments):
    """What the program prints."""
    program = os.environ.get("PURSUIT", "pursuit")
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout


def cell(text):
    """A text in a cell of a table."""
    return str(text).replace("|", "\\|").replace("\n", " ")


def trackers():
    """A section for each tracker, detector and scene, a row for each parameter."""
    found = json.loads(said("trackers", "--json"))
    lines = ["# Trackers, detectors, scenes", "", "Every parameter, as `pursuit trackers NAME --json` prints it.", ""]
    for kind in ("trackers", "detectors", "scenes"):
        lines += [f"## {kind.capitalize()}", ""]
        for entry in found[kind]:
            name = f"scene:{entry['name']}" if kind == "scenes" else entry["name"]
            lines += [f"### `{name}`", "", cell(entry.get("summary", "")), ""]
            if entry["parameters"]:
                lines += ["| parameter | default | range | unit | meaning |", "|---|---|---|---|---|"]
                lines += [*rows(entry["parameters"]), ""]
    return "\n".join(lines)


def rows(parameters, group=""):
    """A row for each parameter, those of groups under their dotted names: choices, or from where to where it may go; which models have
    it, where not all do."""
    for p in parameters:
        name = f"{group}{p['name']}"
        if p.get("parameters"):
            yield from rows(p["parameters"], f"{name}.")
            continue
        least, most = p.get("minimum", p.get("exclusiveMinimum")), p.get("maximum", p.get("exclusiveMaximum"))
        span = ", ".join(f"`{c}`" for c in p.get("choices") or [])
        if not span and (least is not None or most is not None):
            span = f"{'> ' if 'exclusiveMinimum' in p else ''}{number(least)} … {number(most)}"
        doc = p.get("doc", "")
        if p.get("of"):
            doc += f" Only of {', '.join(f'`{model}`' for model in p['of'])}."
        default = json.dumps(p.get("default"), ensure_ascii=False)
        yield f"| `{name}` | `{cell(default)}` | {cell(span)} | {cell(p.get('unit') or '')} | {cell(doc)} |"


def number(value):
    return "" if value is None else f"{value:g}"


def commands():
    """What every command says of itself."""
    lines = ["# Commands", "", "What `pursuit COMMAND --help` prints; `pursuit man COMMAND` has the same as a manual page.", ""]
    for name in subcommands():
        lines += [f"## `pursuit {name}`".rstrip(), "", "```text", said(*name.split(), "--help").rstrip(), "```", ""]
    return "\n".join(lines)


def subcommands(prefix=()):
    """All commands, and theirs, in the order of the help."""
    text = said(*prefix, "--help")
    listed = re.search(r"^Commands:\n((?:  .*\n|\n)+)", text, re.MULTILINE)
    for line in listed.group(1).splitlines() if listed else []:
        name = re.match(r"  ([a-z]+)\b", line)
        if name and name.group(1) != "help":
            yield " ".join((*prefix, name.group(1)))
            yield from subcommands((*prefix, name.group(1)))


def studio():
    """The calls of the studio, from their own description."""
    described = json.loads((ROOT / "apps/studio/src/api/openapi.json").read_text())
    lines = ["# Calls of the studio", "", "From `/api/openapi.json`, which the studio serves.", "", "| call | does |", "|---|---|"]
    for path, calls in described["paths"].items():
        for method, call in calls.items():
            if method in ("get", "put", "post", "delete", "patch"):
                lines.append(f"| `{method.upper()} {path}` | {cell(call.get('summary') or call.get('description') or '')} |")
    return "\n".join(lines) + "\n"
