"""How far a run has come."""

import sys
import time

#: Seconds between two lines.
_EVERY_S = 0.2


def watched(frames, count, name):
    """Hands on the frames of a run, and says how many there were so far of how many; count is None where nobody knows."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _in_a_line(frames, count, name)
    return tqdm(frames, total=count, desc=name, unit=" frames")


def _in_a_line(frames, count, name):
    began = said = time.monotonic()
    done = 0
    of = "" if count is None else f" of {count}"
    try:
        for frame in frames:
            done += 1
            now = time.monotonic()
            if now - said >= _EVERY_S:
                said = now
                print(f"\r{name}: {done}{of} frames, {done / (now - began):.0f} a second", end="", file=sys.stderr, flush=True)
            yield frame
    finally:
        rate = done / max(time.monotonic() - began, 1e-9)
        print(f"\r{name}: {done}{of} frames, {rate:.0f} a second", file=sys.stderr, flush=True)
