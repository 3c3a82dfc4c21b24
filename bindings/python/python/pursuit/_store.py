"""Files that are elsewhere, by fsspec: manifests and inputs read from there, results kept there."""

import contextlib
import fcntl
import json
import os
import pathlib
import shutil
import tempfile
import time

from . import _native

#: Bytes copied at a time, and those that a copy leaves free on the disk.
_PIECE, _SPARE = 8 << 20, 1 << 30
#: The longest wait before an address is tried again, seconds.
_LONGEST_WAIT = 30.0
_FINISHED = "finished.json"
_PARTITION = "trajectory.parquet"
#: In the folder of a batch while it runs: how often each clip was begun that is not over.
_BEGUN = ".begun"


def is_elsewhere(address):
    """Whether this is an address that fsspec reads; cameras, streams and scenes are none, nor are paths."""
    scheme, there_is_one, _ = address.partition("://")
    if not there_is_one:
        return False
    from fsspec import available_protocols

    return scheme.split("::")[0] in available_protocols()


def lines_of(manifest, options):
    """The text of a manifest, and what to call it."""
    if not isinstance(manifest, (str, os.PathLike)):
        return "".join(_line(item) + "\n" for item in manifest), "given"
    address = os.fspath(manifest)
    if address.endswith((".jsonl", ".txt")):
        try:
            with _file_system().open(address, "rt", encoding="utf-8", **options) as file:
                return file.read(), address
        except (OSError, UnicodeDecodeError) as error:
            raise _native.UsageError(f"manifest {address} cannot be read: {error}") from None
    if any(c in address for c in "*?[") and (is_elsewhere(address) or "://" not in address):
        found = _matching(address, options)
        if not found:
            raise _native.UsageError(f"pattern {address}: no file matches")
        return "".join(_line(path) + "\n" for path in found), address
    return _line(address) + "\n", address


def _line(item):
    if not isinstance(item, (dict, str, os.PathLike)):
        raise _native.UsageError(f"a clip is a text, a path or a dict, not a {type(item).__name__}")
    line = json.dumps(item) if isinstance(item, dict) else os.fspath(item)
    if "\n" in line.strip():
        raise _native.UsageError(f"{line[:80]!r}: a clip is one line")
    return line


def _matching(address, options):
    system, path = _file_system().core.url_to_fs(address, **options)
    found = sorted(system.glob(path))
    if "://" in address:
        return [system.unstrip_protocol(p) for p in found]
    # As they were asked for, not made absolute.
    return [p if os.path.isabs(address) else os.path.relpath(p) for p in found]


def _file_system():
    try:
        import fsspec
    except ImportError:
        raise _native.UsageError("fsspec is not installed: pip install 'pursuit-tracking[ray]'") from None
    return fsspec


def _patiently(attempt, retries):
    """What the attempt returns; again after a while where it fails otherwise than for good."""
    for number in range(retries + 1):
        try:
            return attempt()
        except (FileNotFoundError, PermissionError, IsADirectoryError, NotImplementedError, ValueError):
            raise
        except Exception:
            if number == retries:
                raise
            time.sleep(min(0.5 * 2**number, _LONGEST_WAIT))


def fetch(address, folder, options, retries):
    """Copies what the address names into a folder, with its truth beside it where there is some; returns the copy's path."""
    try:
        return _patiently(lambda: _fetch(address, folder, options), retries)
    except Exception as error:
        what = " ".join(str(error).split()) or type(error).__name__
        raise _native.InputError(f"{address} cannot be fetched: {what}") from None


def _fetch(address, folder, options):
    system, path = _file_system().core.url_to_fs(address, **options)
    copy = folder / (path.rstrip("/").rsplit("/", 1)[-1].partition("?")[0] or "input")
    by_http = address.startswith(("http://", "https://"))
    if not by_http and system.isdir(path):
        system.get(path.rstrip("/") + "/", f"{copy}/", recursive=True)
        return str(copy)
    _copy(system, path, copy)
    stem, dot, _ = path.rpartition(".")
    if dot and "/" not in path[len(stem) :] and "?" not in path:
        with contextlib.suppress(FileNotFoundError):
            if system.exists(f"{stem}.csv"):
                _copy(system, f"{stem}.csv", copy.with_suffix(".csv"))
    return str(copy)


def _copy(system, path, copy):
    with system.open(path, "rb") as source, copy.open("wb") as target:
        while piece := source.read(_PIECE):
            if shutil.disk_usage(copy.parent).free < _SPARE + len(piece):
                raise ValueError(f"the disk of {copy.parent} would be full; clips need a file of an end and a size")
            target.write(piece)


class Scratch:
    """Folders of a task's own, removed at its end; those whose process was killed are removed by the next task there."""

    def __init__(self):
        self._root = self._lock = None

    def __enter__(self):
        return self

    def folder(self):
        """A new folder."""
        if self._root is None:
            home = pathlib.Path(tempfile.gettempdir()) / f"pursuit-ray-{os.getuid()}"
            home.mkdir(mode=0o700, exist_ok=True)
            self._root = pathlib.Path(tempfile.mkdtemp(dir=home))
            # The system lets go of the lock when the process ends, however it ends.
            self._lock = os.open(self._root, os.O_RDONLY)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
            _sweep(home)
        return pathlib.Path(tempfile.mkdtemp(dir=self._root))

    def __exit__(self, *_):
        if self._root is not None:
            shutil.rmtree(self._root, ignore_errors=True)
            os.close(self._lock)


def _sweep(home):
    for left in home.iterdir():
        with contextlib.suppress(OSError):
            descriptor = os.open(left, os.O_RDONLY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # One that was just made is not locked yet.
                if time.time() - left.stat().st_mtime > 60:
                    shutil.rmtree(left, ignore_errors=True)
            finally:
                os.close(descriptor)


class Store:
    """Where the results of a batch are kept: a folder that every machine sees, or an address."""

    def __init__(self, out, options):
        self._out, self._options = os.fspath(out), options
        self._elsewhere = is_elsewhere(self._out)
        if self._out == "-" or ("://" in self._out and not self._elsewhere):
            raise _native.UsageError(f"{self._out} is no folder for results; name one, or an address that fsspec knows")
        if not self._elsewhere:
            self._out = os.path.abspath(self._out)
            try:
                os.makedirs(self._out, exist_ok=True)
            except OSError as error:
                raise _native.OutputError(f"cannot write {self._out}: {error.strerror}") from None

    def _system(self):
        return _file_system().core.url_to_fs(self._out, **self._options)

    def write(self, name, text):
        """Writes a file of the batch as a whole."""
        if self._elsewhere:
            system, root = self._system()
            system.makedirs(root, exist_ok=True)
            system.pipe_file(f"{root}/{name}", text.encode())
            return
        path = pathlib.Path(self._out, name)
        part = path.with_name(f"{name}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)

    def settle(self):
        """Forgets how often clips were begun."""
        if not self._elsewhere:
            shutil.rmtree(pathlib.Path(self._out, _BEGUN), ignore_errors=True)
            return
        system, root = self._system()
        if system.exists(f"{root}/{_BEGUN}"):
            system.rm(f"{root}/{_BEGUN}", recursive=True)

    def begun(self, name):
        """Notes that a clip is begun; how often it has been since the batch was."""
        if not self._elsewhere:
            path = pathlib.Path(self._out, _BEGUN, name)
            path.parent.mkdir(exist_ok=True)
            # One byte for each time: a file that is longer was begun more often, whenever the power fails.
            with path.open("ab") as file:
                file.write(b".")
                return file.tell()
        system, root = self._system()
        path, count = f"{root}/{_BEGUN}/{name}", 0
        with contextlib.suppress(FileNotFoundError):
            count = len(system.cat_file(path))
        system.makedirs(f"{root}/{_BEGUN}", exist_ok=True)
        system.pipe_file(path, b"." * (count + 1))
        return count + 1

    def holds(self, clip, scratch):
        """Whether the clip is done already, so that its input need not be fetched."""
        folder = self._earlier(clip[0], scratch) if self._elsewhere else self._out
        return _native.batch_finished(clip, folder)

    def track(self, clip, fetched, scratch, retries):
        """Tracks a clip unless it is done; how it ended and what finished.json holds."""
        if not self._elsewhere:
            return _native.batch_clip(clip, self._out, fetched)
        folder = self._earlier(clip[0], scratch)
        how, outcome = _native.batch_clip(clip, folder, fetched)
        if how in ("done", "failed"):
            _patiently(lambda: self._keep(clip[0], folder), retries)
        return how, outcome

    def _earlier(self, name, scratch):
        """A folder of a batch with what an earlier call says of the clip: that it is finished, and has its partition."""
        system, root = self._system()
        folder = scratch.folder()
        clip, partition = folder / "clips" / name, folder / "dataset" / f"clip={name}"
        with contextlib.suppress(FileNotFoundError):
            finished = system.cat_file(f"{root}/clips/{name}/{_FINISHED}")
            clip.mkdir(parents=True)
            (clip / _FINISHED).write_bytes(finished)
            if system.exists(f"{root}/dataset/clip={name}/{_PARTITION}"):
                partition.mkdir(parents=True)
                (partition / _PARTITION).touch()
        return folder

    def _keep(self, name, folder):
        """Puts the files of a clip where results are kept; finished.json comes last, and an earlier one goes first."""
        system, root = self._system()
        if system.exists(f"{root}/clips/{name}"):
            system.rm(f"{root}/clips/{name}", recursive=True)
        files = [p for p in folder.rglob("*") if p.is_file() and not p.name.startswith(".")]
        for path in sorted(files, key=lambda p: p.name == _FINISHED):
            address = f"{root}/{path.relative_to(folder).as_posix()}"
            system.makedirs(address.rpartition("/")[0], exist_ok=True)
            system.put_file(str(path), address)
