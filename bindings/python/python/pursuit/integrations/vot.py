"""Trackers of pursuit for the VOT toolkit (pip install vot-toolkit), by the TraX protocol.

`python -m pursuit.integrations.vot --ini > trackers.ini` writes an entry for every tracker, which the toolkit finds in its
workspace; `python -m pursuit.integrations.vot NAME [--many] [--set KEY=VALUE]…` is what such an entry starts. With `--many`
the tracker follows several objects at a time, for the toolkit's experiments of that kind.
"""

import argparse
import shlex
import sys

from .. import _native
from .trax import Server, TraxError


def entries(python=sys.executable, many=False):
    """The text of a trackers.ini with every tracker of the registry, run by this Python; for several objects with `many`."""
    text = []
    for name in _native.trackers():
        command = f"{shlex.quote(python)} -m pursuit.integrations.vot {name}{' --many' if many else ''}"
        entry = f"pursuit-{name}{'-many' if many else ''}"
        text.append(f"[{entry}]\nlabel = {entry}\nprotocol = trax\ncommand = {command}\n")
    return "\n".join(text)


def serve(server, tracker):
    """Answers until the other side is done: images are read by pursuit's own decoders."""
    for message, image, region in server:
        estimate = tracker.init(image, region) if message == "initialize" else tracker.update(image)
        server.state(estimate.box, confidence=f"{estimate.score:.6f}")


def serve_many(server, tracker):
    """As serve, with a MultiTracker of targets without a detector: an object that is named later joins in its frame."""
    named, new = [], []
    for message, image, region in server:
        if message == "initialize":
            new.append(region)
            continue
        known = {e.target: (e.box, e.score) for e in tracker.update(image)} if named else {}
        for region in new:
            target = tracker.add(image, region)
            named.append(target)
            known[target] = (region, 1.0)
        new.clear()
        for target in named:
            box, score = known[target]
            server.state(box, confidence=f"{score:.6f}")


def _value(text):
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return {"true": True, "false": False}.get(text, text)


def main(arguments=None):
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m pursuit.integrations.vot", description=__doc__.splitlines()[0])
    parser.add_argument("tracker", nargs="?", default=_native.DEFAULT_TRACKER)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="set a parameter")
    parser.add_argument("--many", action="store_true", help="follow several objects at a time (TraX 4)")
    parser.add_argument("--ini", action="store_true", help="print a trackers.ini with every tracker")
    given = parser.parse_args(arguments)
    if given.ini:
        print(entries(many=given.many))
        return 0
    server = None
    try:
        settings = dict(s.partition("=")[::2] for s in given.set)
        kind = _native.MultiTracker if given.many else _native.Tracker
        tracker = kind(given.tracker, **{key: _value(value) for key, value in settings.items()})
        server = Server(given.tracker, description=_native.trackers()[given.tracker], many=given.many)
        (serve_many if given.many else serve)(server, tracker)
    except (_native.PursuitError, TraxError) as error:
        if server is not None:
            server.quit(str(error))
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
