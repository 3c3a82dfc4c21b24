"""`pursuit batch` on a cluster, by Ray Data (pip install pursuit-tracking[ray]).

>>> import pursuit.ray  # doctest: +SKIP
>>> summary = pursuit.ray.batch("s3://clips/clips.jsonl", "s3://results/run-1", tracker="kcf")  # doctest: +SKIP

Ray shares the clips out, starts them again where a worker or a machine died, and holds back what would not fit. A clip is one
task; it is done when its finished.json is there, which is written last, so that the same call goes on with what is there.
"""

import functools
import json
import os
import time

from . import _native
from ._store import Scratch, Store, fetch, is_elsewhere, lines_of

__all__ = ["batch"]

#: Clips that Ray is handed at a time, where it is not said how many are to be tracked at a time.
_MOST_WAITING = 1000


def batch(
    manifest,
    out,
    *,
    jobs=None,
    cpus=1,
    retries=5,
    tell=None,
    storage_options=None,
    tracker=None,
    detect=None,
    many=False,
    box=None,
    video=False,
    **parameters,
):
    """Tracks every clip of a manifest that is not done yet, on the cluster that Ray is connected to; returns what batch.json
    holds, a dict: `clips` and `failed` with name, frames, seconds and error each, how many an `earlier` call had done, `left`.

    manifest: of `pursuit batch`, a path or any address that fsspec knows (s3://…, https://…); a pattern of files; or an
    iterable of lines, texts or dicts. Inputs may be such addresses too: a worker copies one with its truth beside it into a
    folder of its own, tracks it, and removes the copy. Paths must lead to the same files on every machine.
    out: where the results go, a folder that every machine sees or an address; the files are those of `pursuit batch`.
    jobs: most clips at a time; as many as there are processors without. cpus: processors that a clip takes. retries: how often
    a clip is begun again whose worker died, and an address read again that failed. tell: called with (clip, how, outcome)
    when a clip is over, how being "done", "earlier" or "failed". storage_options: of fsspec, for the addresses.
    tracker, detect, many, box, video, parameters: as of pursuit.track, for the clips that do not say otherwise themselves.

    Raises UsageError for a manifest that makes no sense, before anything is begun; what is wrong with a clip is in the result.
    """
    try:
        import ray.data
    except ImportError as error:
        raise _native.UsageError(f"Ray Data is not installed ({error}): pip install 'pursuit-tracking[ray]'") from None
    began = time.monotonic()
    options = storage_options or {}
    text, name = lines_of(manifest, options)
    clips = _native.batch_jobs(text, name, _common(tracker, detect, many, box, video, parameters))
    if not clips:
        raise _native.UsageError("there are no clips; name videos, folders of images, or a manifest")
    store = Store(out, options)
    store.settle()
    ends = {}
    try:
        for row in _rows(ray.data, clips, store, options, jobs, cpus, retries):
            index, how, outcome = row["index"], row["how"], row["outcome"]
            ends[index] = (how, outcome)
            if tell is not None and outcome is not None:
                tell(clips[index][0], how, json.loads(outcome))
        for index, clip in enumerate(clips):
            if index not in ends:
                ends[index] = ("failed", _native.batch_failed(clip, "Ray gave its task up; the log of Ray Data says why"))
        store.settle()
    finally:
        told = [ends[index] for index in sorted(ends)]
        summary = _native.batch_summary(told, len(clips), time.monotonic() - began)
        store.write("batch.json", summary)
    return json.loads(summary)


def _common(tracker, detect, many, box, video, parameters):
    from ._track import _boxes, _models

    given = dict(tracker=tracker, detect=detect, boxes=_boxes(box) or None, many=True if many else None)
    return given | dict(video=video, parameters=_models(tracker, parameters) or None)


def _rows(data, clips, store, options, jobs, cpus, retries):
    context = data.DataContext.get_current()
    # What goes wrong with one task must not cost the others. And Ray itself knows what fits where: were no more handed to it
    # than there are processors, each would wait until Ray Data had noticed that the one before is over, a tenth of a second
    # and more. What comes of a clip is a line, which needs no place kept for it.
    ours = {"max_errored_blocks": -1, "op_resource_reservation_enabled": False}
    before = {name: getattr(context, name) for name in ours if hasattr(context, name)}
    for name in before:
        setattr(context, name, ours[name])
    try:
        rows = [{"index": index, "clip": json.dumps(clip)} for index, clip in enumerate(clips)]
        work = functools.partial(_track, store=store, options=options, folder=os.getcwd(), cpus=cpus, retries=retries)
        # One clip a block: a task that is begun again begins one clip again.
        items = data.from_items(rows, override_num_blocks=len(rows))
        yield from items.map(work, num_cpus=cpus, compute=data.TaskPoolStrategy(size=jobs or _MOST_WAITING)).iter_rows()
    finally:
        for name, value in before.items():
            setattr(context, name, value)


def _track(row, store, options, folder, cpus, retries):
    """One clip, in a worker; whatever is wrong with it is its end, not the task's."""
    clip = tuple(json.loads(row["clip"]))
    # What pursuit does in parallel within a clip is to take no more than Ray was told; read when that is first needed.
    os.environ.setdefault("RAYON_NUM_THREADS", str(max(1, round(cpus))))
    if os.path.isdir(folder):
        os.chdir(folder)
    try:
        with Scratch() as scratch:
            fetched = {}
            if not store.holds(clip, scratch):
                # Ray Data begins a task again for ever; a clip that ends its worker each time would hold the batch up.
                if store.begun(clip[0]) > retries + 1:
                    raise _native.ComputationError(f"its worker died at every one of {retries + 1} attempts")
                addresses = [address for address in clip[1:3] if address and is_elsewhere(address)]
                fetched = {address: fetch(address, scratch.folder(), options, retries) for address in addresses}
            how, outcome = store.track(clip, fetched, scratch, retries)
    except Exception as error:  # noqa: BLE001
        how, outcome = "failed", _native.batch_failed(clip, " ".join(str(error).split()) or type(error).__name__)
    return {"index": row["index"], "how": how, "outcome": outcome}
