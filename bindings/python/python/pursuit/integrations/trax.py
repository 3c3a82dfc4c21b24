"""The TraX protocol from a tracker's side: lines on standard streams, or on a socket where TRAX_SOCKET names one.

Messages are lines `@@TRAX:name "argument" … "key=value" …` (Cehovin, "TraX: The visual tracking eXchange protocol and
library", Neurocomputing 260, 2017). Spoken here: hello, initialize, frame, state, quit; image paths; rectangles. Version 3
follows one object, named with its image. In version 4 with `trax.multiobject` an initialize names an object of the frame that
comes next, as many as there are new ones; every frame is answered by a state for each object, in order of their naming.
"""

import os
import re
import socket
import sys
from urllib.parse import unquote, urlparse

PREFIX = "@@TRAX:"
#: Longest line taken: regions and paths are far shorter.
LONGEST_LINE = 1 << 20
_QUOTED = re.compile(r'"((?:[^"\\]|\\.)*)"')


class TraxError(Exception):
    """A message that is not of the protocol."""


def quoted(text):
    """An argument as it stands in a line."""
    text = str(text).replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{text}"'


def parse(line):
    """The name of a message, its arguments and its properties; None where the line is no message."""
    if not line.startswith(PREFIX):
        return None
    name, _, rest = line[len(PREFIX) :].strip().partition(" ")
    arguments, properties = [], {}
    for match in _QUOTED.finditer(rest):
        text = re.sub(r"\\(.)", lambda m: "\n" if m[1] == "n" else m[1], match[1])
        key, equals, value = text.partition("=")
        if equals and re.fullmatch(r"[A-Za-z][\w.\-]*", key):
            properties[key] = value
        else:
            arguments.append(text)
    return name, arguments, properties


def path_of(image):
    """The path of an image argument: file:///path, channels aside, or a plain path."""
    url = urlparse(image)
    return unquote(url.path) if url.scheme == "file" else image


def region_of(text):
    """Left, top, width, height of a rectangle, or of the least box around a polygon."""
    try:
        values = [float(v) for v in text.split(",")]
    except ValueError:
        raise TraxError(f"region {text[:80]!r} is neither a rectangle nor a polygon") from None
    if len(values) == 4:
        return tuple(values)
    if len(values) >= 6 and len(values) % 2 == 0:
        xs, ys = values[0::2], values[1::2]
        return min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)
    raise TraxError(f"region {text[:80]!r} has {len(values)} numbers")


class Server:
    """A connection to whoever evaluates: iterate over it for (name, image path or None, region or None) of each message.

    many: several objects, by version 4 of the protocol.
    """

    def __init__(self, name, *, description="", many=False, reader=None, writer=None):
        port = os.environ.get("TRAX_SOCKET")
        if reader is not None:
            self._reader, self._writer = reader, writer
        elif port:
            connection = socket.create_connection(("127.0.0.1", int(port)))
            self._reader, self._writer = connection.makefile("rb"), connection.makefile("wb")
        else:
            self._reader, self._writer = sys.stdin.buffer, sys.stdout.buffer
        self._many = many
        self._send(
            "hello",
            **{
                "trax.version": "4" if many else "3",
                "trax.name": name,
                "trax.description": description,
                "trax.family": "pursuit",
                "trax.image": "path;",
                "trax.region": "rectangle;",
                "trax.channels": "color",
            }
            | ({"trax.multiobject": "1"} if many else {}),
        )

    def _send(self, message, *arguments, **properties):
        words = [quoted(a) for a in arguments] + [quoted(f"{k}={v}") for k, v in properties.items()]
        self._writer.write((" ".join([PREFIX + message, *words]) + "\n").encode())
        self._writer.flush()

    def state(self, box, **properties):
        """Answers with a box, left, top, width, height in pixels."""
        self._send("state", ",".join(repr(float(v)) for v in box), **properties)

    def quit(self, reason=""):
        """Ends the conversation from this side."""
        self._send("quit", **({"trax.reason": reason} if reason else {}))

    def __iter__(self):
        while line := self._reader.readline(LONGEST_LINE):
            message = parse(line.decode(errors="replace"))
            if message is None:
                continue
            name, arguments, _ = message
            if name == "quit":
                return
            if name == "initialize" and self._many and len(arguments) == 1:
                yield name, None, region_of(arguments[0])
            elif name == "initialize" and not self._many and len(arguments) >= 2:
                yield name, path_of(arguments[0]), region_of(arguments[1])
            elif name == "frame" and arguments:
                yield name, path_of(arguments[0]), None
            else:
                raise TraxError(f"message {name!r} with {len(arguments)} arguments")
