"""Trackers and detectors by name, with help made from the registry: nothing here names one of them."""

import inspect
import keyword
from collections.abc import Mapping

from . import _native


def _keyword(name):
    """The name as an argument: Python keeps some words for itself."""
    return f"{name}_" if keyword.iskeyword(name) else name


def _type(parameter):
    kind = parameter["type"]
    return {"number": "float", "integer": "int", "flag": "bool", "text": "str", "file": "str"}.get(kind, "str")


def _range(parameter):
    words = []
    for key, text in (
        ("minimum", "at least {}"),
        ("exclusiveMinimum", "above {}"),
        ("maximum", "at most {}"),
        ("exclusiveMaximum", "below {}"),
        ("step", "in steps of {}"),
    ):
        if parameter.get(key) is not None:
            words.append(text.format(f"{parameter[key]:g}"))
    if parameter.get("choices"):
        words.append("one of " + ", ".join(parameter["choices"]))
    return ", ".join(words)


def _lines(schema, prefix=""):
    """One entry for each parameter, those of groups under group__name."""
    for p in schema:
        if p["type"] == "group":
            yield from _lines(p["parameters"], f"{prefix}{p['name']}__")
            continue
        facts = ", ".join(x for x in (_type(p), p.get("unit"), _range(p), p.get("source")) if x)
        doc = " ".join(p["doc"].split())
        yield f"{prefix}{_keyword(p['name'])} = {p.get('default')!r}\n    {doc} ({facts})"


class Entry:
    """A tracker or a detector of the registry: calling it makes one. help() of it shows every parameter."""

    def __init__(self, name, summary, maker, detector=False):
        self.name, self.summary = name, summary
        self._maker, self._detector = maker, detector
        self.__name__ = self.__qualname__ = name.replace("-", "_")

    @property
    def parameters(self):
        """Every parameter: name, type, range, unit, source, meaning and default; groups have parameters of their own."""
        return _native.parameters(self.name, detector=self._detector)

    @property
    def __doc__(self):
        made = "Detector" if self._detector else "Tracker"
        lines = "\n".join(_lines(self.parameters))
        return f"{self.summary}\n\nReturns a pursuit.{made}. Parameters of groups are group__name; a word for a group names its model.\n\n{lines}"

    @property
    def __signature__(self):
        kinds = inspect.Parameter
        given = [
            kinds(_keyword(p["name"]), kinds.KEYWORD_ONLY, default=p.get("default"))
            for p in self.parameters
        ]
        return inspect.Signature([*given, kinds("more", kinds.VAR_KEYWORD)])

    def __call__(self, **parameters):
        return self._maker(self.name, **parameters)

    def __repr__(self):
        return f"<pursuit {self.name}: {self.summary}>"


class Registry(Mapping):
    """Entries by name; as attributes, with _ for -."""

    def __init__(self, summaries, maker, what, detector=False):
        self._entries = {name: Entry(name, summary, maker, detector) for name, summary in summaries.items()}
        self._what = what
        self.__doc__ = f"Every {what} by name: " + ", ".join(self._entries)

    def __getitem__(self, name):
        return self._entries[name]

    def __iter__(self):
        return iter(self._entries)

    def __len__(self):
        return len(self._entries)

    def __getattr__(self, name):
        entry = self.__dict__.get("_entries", {}).get(name.replace("_", "-"))
        if entry is None:
            raise AttributeError(f"there is no {self._what} called {name!r}; there are: {', '.join(self._entries)}")
        return entry

    def __dir__(self):
        return [*super().__dir__(), *(name.replace("-", "_") for name in self._entries)]

    def __repr__(self):
        return "\n".join(f"{name:24} {entry.summary}" for name, entry in self._entries.items())


trackers = Registry(_native.trackers(), _native.Tracker, "tracker")
detectors = Registry(_native.detectors(), _native.Detector, "detector", detector=True)
