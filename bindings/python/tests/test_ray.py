"""pursuit.ray: the files of `pursuit batch`, workers that are killed, addresses; what is not installed is skipped."""

import functools
import http.server
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pursuit
import pytest
from conftest import moving_square
from pursuit import _native

pytest.importorskip("ray", reason="ray is not installed: pip install 'pursuit-tracking[ray]'")
pytest.importorskip("fsspec")
import pursuit.ray  # noqa: E402
from pursuit._store import Scratch, Store, fetch, is_elsewhere, lines_of  # noqa: E402


@pytest.fixture(scope="module")
def cluster():
    import ray

    # Workers are nice to others by default, 15; on a machine where others compile they would never come to anything.
    os.environ["RAY_worker_niceness"] = "0"
    ray.init(num_cpus=2, include_dashboard=False, logging_level="warning", log_to_driver=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    yield ray
    ray.shutdown()


def video(path, frames=20):
    """A Y4M file of the moving square; returns its first box."""
    images, boxes = moving_square(frames=frames)
    chroma = np.full(120 * 160 // 2, 128, np.uint8).tobytes()
    path.write_bytes(b"YUV4MPEG2 W160 H120 F25:1 C420\n" + b"".join(b"FRAME\n" + i.tobytes() + chroma for i in images))
    return list(map(float, boxes[0]))


def scenes(count, duration=1):
    return [{"name": f"clip-{k}", "input": f"scene:drift?seed={k}&duration={duration}"} for k in range(count)]


def untimed(line):
    """A line of a trajectory without the time that an update took."""
    cells = line.split(",")
    return ",".join(cells[:17] + cells[18:])


def without_times(path):
    """What a file of a batch holds, but for times and the machine."""
    if path.suffix == ".csv":
        return [untimed(line) for line in path.read_text().splitlines()]
    if path.suffix == ".json":
        known = json.loads(path.read_text())
        for key in ("timing", "host", "seconds"):
            known.pop(key, None)
        for outcome in known.get("clips", []) + known.get("failed", []):
            outcome.pop("seconds")
        return known
    return path.read_bytes()


def files(out):
    """Everything but the dataset, which not every build of the command writes, and what tells of it."""
    found = {str(p.relative_to(out)): without_times(p) for p in sorted(out.rglob("*")) if p.is_file()}
    found["batch.json"].pop("dataset")
    return {name: known for name, known in found.items() if not name.startswith("dataset/")}


def test_the_files_are_those_of_the_command(cluster, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "garbage.mp4").write_bytes(b"\7" * 5000)
    box = video(tmp_path / "square.y4m")
    cut = (tmp_path / "square.y4m").read_bytes()
    (tmp_path / "cut.y4m").write_bytes(cut[: len(cut) // 2 + 100])
    lines = [json.dumps(scene) for scene in scenes(4)]
    lines += [json.dumps({"input": "square.y4m", "boxes": [box], "tracker": "kcf", "parameters": {"lambda": 2e-4}})]
    lines += [json.dumps({"input": "cut.y4m", "boxes": [box]}), "# broken ones", "garbage.mp4", "no/such/clip.mp4"]
    (tmp_path / "clips.jsonl").write_text("\n".join(lines) + "\n")
    program = [command, "-q", "batch", "clips.jsonl", "--tracker", "mosse", "--jobs", "2", "--out", "by-command"]
    assert subprocess.run(program, capture_output=True).returncode == 3
    told = []
    summary = pursuit.ray.batch("clips.jsonl", "by-ray", tracker="mosse", tell=lambda clip, how, _: told.append((clip, how)))
    assert files(tmp_path / "by-ray") == files(tmp_path / "by-command")
    assert len(summary["clips"]) == 5 and len(summary["failed"]) == 3 and summary["left"] == 0
    assert sorted(told) == sorted([(c["clip"], "done") for c in summary["clips"]] + [(c["clip"], "failed") for c in summary["failed"]])
    dataset = sorted((tmp_path / "by-ray" / "dataset").glob("clip=*/trajectory.parquet"))
    assert {p.parent.name for p in dataset} >= {f"clip={c['clip']}" for c in summary["clips"]}
    import pyarrow.parquet

    rows = pyarrow.parquet.read_table(tmp_path / "by-ray/dataset/clip=square/trajectory.parquet").to_pylist()
    text = (tmp_path / "by-ray/clips/square/trajectory.csv").read_text().splitlines()[1:]
    assert len(rows) == len(text) == 20
    assert [f"{r['x']:.3f}" for r in rows] == [f"{float(line.split(',')[4]):.3f}" for line in text]


def workers():
    """Processes of this one's cluster that have a clip in hand."""
    found = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if b"_track" in (process / "cmdline").read_bytes() and os.getpid() in ancestors(int(process.name)):
                found.append(int(process.name))
        except OSError:
            pass
    return found


def ancestors(process):
    chain = []
    while process > 1:
        text = pathlib.Path(f"/proc/{process}/stat").read_text()
        process = int(text.rpartition(")")[2].split()[1])
        chain.append(process)
    return chain


def finished(out):
    return {p.parent.name: p.stat().st_mtime_ns for p in pathlib.Path(out).glob("clips/*/finished.json")}


def test_killed_workers_cost_nothing_that_was_done(cluster, tmp_path):
    clips, out = [*scenes(12, duration=4), "no/such/clip.mp4"], tmp_path / "out"
    killed, seen, over = [], {}, threading.Event()

    def kill():
        while not over.is_set():
            for name, at in finished(out).items():
                assert seen.setdefault(name, at) == at
            if len(killed) < 2 and len(seen) > 2 + 3 * len(killed):
                for process in workers()[:1]:
                    os.kill(process, signal.SIGKILL)
                    killed.append(process)
            time.sleep(0.02)

    killer = threading.Thread(target=kill)
    killer.start()
    summary = pursuit.ray.batch(clips, out, tracker="kcf")
    over.set()
    killer.join()
    assert killed, "it was over before a worker could be killed"
    assert [c["clip"] for c in summary["clips"]] == [f"clip-{k}" for k in range(12)]
    assert [c["clip"] for c in summary["failed"]] == ["clip"] and summary["left"] == 0
    done = finished(out)
    assert all(done[name] == at for name, at in seen.items() if name != "clip"), "a clip that was done was done again"
    # The same call does nothing again but what failed; another wish is another run.
    again = pursuit.ray.batch(clips, out, tracker="kcf")
    assert again["earlier"] == 12 and len(again["failed"]) == 1
    after = finished(out)
    assert {n: at for n, at in after.items() if n != "clip"} == {n: at for n, at in done.items() if n != "clip"}
    otherwise = pursuit.ray.batch(clips[:2], out, tracker="kcf", motion="none")
    assert otherwise["earlier"] == 0 and len(otherwise["clips"]) == 2


class Deadly(Store):
    """Ends its process at one clip."""

    def track(self, clip, *given):
        if clip[0] == "bad":
            os.kill(os.getpid(), signal.SIGKILL)
        return super().track(clip, *given)


def test_a_clip_that_kills_every_worker_is_given_up(cluster, tmp_path, monkeypatch):
    cluster.cloudpickle.register_pickle_by_value(sys.modules[__name__])
    monkeypatch.setattr(pursuit.ray, "Store", Deadly)
    clips = [*scenes(2), {"name": "bad", "input": "scene:drift"}]
    summary = pursuit.ray.batch(clips, tmp_path, tracker="mosse", retries=1)
    assert len(summary["clips"]) == 2 and not (tmp_path / ".begun").exists()
    assert [(c["clip"], c["error"]) for c in summary["failed"]] == [("bad", "its worker died at every one of 2 attempts")]


@pytest.fixture
def server(tmp_path):
    """A folder of files by HTTP on loopback: its address and the folder."""
    pytest.importorskip("aiohttp")
    folder = tmp_path / "served"
    folder.mkdir()
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    handler_quiet = type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None})
    handler = functools.partial(handler_quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as serving:
        threading.Thread(target=serving.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{serving.server_port}", folder
        serving.shutdown()


def test_clips_and_manifest_by_http(cluster, server, tmp_path):
    address, folder = server
    box = video(folder / "square.y4m")
    truth = "index,x,y,w,h\n" + "".join(f"{k},{','.join(map(str, b))}\n" for k, b in enumerate(moving_square(frames=20)[1]))
    (folder / "square.csv").write_text(truth)
    lines = [f"{address}/square.y4m", f"{address}/missing.y4m"]
    (folder / "clips.txt").write_text("\n".join(lines))
    summary = pursuit.ray.batch(f"{address}/clips.txt", tmp_path / "out", tracker="kcf")
    assert [c["clip"] for c in summary["clips"]] == ["square"]
    assert f"{address}/missing.y4m" in summary["failed"][0]["error"]
    facts = json.loads((tmp_path / "out/clips/square/run.json").read_text())
    assert facts["input"]["name"] == f"{address}/square.y4m" and facts["accuracy"]["mean_iou"] > 0.8
    near = pursuit.track(folder / "square.y4m", box, tracker="kcf", out=tmp_path / "near", video=False).run()
    assert near.facts["recipe"]["boxes"] == facts["recipe"]["boxes"]
    assert without_times(tmp_path / "near/trajectory.csv") == without_times(tmp_path / "out/clips/square/trajectory.csv")


def test_results_and_inputs_of_an_object_store(tmp_path):
    import fsspec

    memory = fsspec.filesystem("memory")
    box = video(tmp_path / "square.y4m")
    memory.pipe_file("/bucket/clips/square.y4m", (tmp_path / "square.y4m").read_bytes())
    memory.pipe_file("/bucket/clips.jsonl", json.dumps({"input": "memory://bucket/clips/square.y4m", "boxes": [box]}).encode())
    text, name = lines_of("memory://bucket/clips.jsonl", {})
    assert lines_of("memory://bucket/clips/*.y4m", {})[0].split("//")[1].strip("/\n") == "bucket/clips/square.y4m"
    (clip,) = _native.batch_jobs(text, name, {"tracker": "kcf"})
    store = Store("memory://bucket/out", {})

    def track(clip):
        with Scratch() as scratch:
            fetched = {} if store.holds(clip, scratch) else {clip[1]: fetch(clip[1], scratch.folder(), {}, 0)}
            home = scratch.folder().parent
            ended = store.track(clip, fetched, scratch, 0)
        assert not home.exists(), "the copy is left behind"
        return ended

    how, outcome = track(clip)
    assert (how, json.loads(outcome)["frames"]) == ("done", 20)
    kept = sorted(memory.find("/bucket/out"))
    assert [p.rpartition("out/")[2] for p in kept] == [
        "clips/square/finished.json", "clips/square/run.json", "clips/square/trajectory.csv", "dataset/clip=square/trajectory.parquet",
    ]  # fmt: skip
    near = pursuit.track(tmp_path / "square.y4m", box, tracker="kcf", out=tmp_path / "near", video=False).run()
    assert near.facts["frame_count"] == 20
    far = memory.cat_file("/bucket/out/clips/square/trajectory.csv").decode().splitlines()
    assert [untimed(line) for line in far] == without_times(tmp_path / "near/trajectory.csv")
    at = memory.modified("/bucket/out/clips/square/finished.json")
    assert track(clip)[0] == "earlier" and memory.modified("/bucket/out/clips/square/finished.json") == at
    memory.rm("/bucket/out/dataset", recursive=True)
    assert track(clip)[0] == "done", "without its partition it is not whole"
    store.write("batch.json", "{}\n")
    assert memory.cat_file("/bucket/out/batch.json") == b"{}\n"


def test_an_s3_compatible_store(cluster, tmp_path):
    moto = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    try:
        address = "http://{}:{}".format(*server.get_host_and_port())
        options = dict(key="user", secret="sesame", endpoint_url=address, client_kwargs={"region_name": "eu-west-1"})
        bucket = s3fs.S3FileSystem(**options, skip_instance_cache=True)
        bucket.mkdir("bucket")
        box = video(tmp_path / "square.y4m")
        for name in ("one", "two"):
            bucket.put_file(str(tmp_path / "square.y4m"), f"bucket/clips/{name}.y4m")
        summary = pursuit.ray.batch("s3://bucket/clips/*.y4m", "s3://bucket/out", box=box, tracker="kcf", storage_options=options)
        assert [c["clip"] for c in summary["clips"]] == ["one", "two"], summary
        kept = [p.removeprefix("bucket/out/") for p in bucket.find("bucket/out")]
        assert len(kept) == 2 * 4 + 1 and "batch.json" in kept and not any(".begun" in p for p in kept)
        again = pursuit.ray.batch("s3://bucket/clips/*.y4m", "s3://bucket/out", box=box, tracker="kcf", storage_options=options)
        assert again["earlier"] == 2 and "sesame" not in bucket.cat_file("bucket/out/clips/one/run.json").decode()
    finally:
        server.stop()


def test_a_read_that_fails_is_tried_again_and_one_that_cannot_be_is_told(tmp_path, monkeypatch):
    import fsspec
    from fsspec.implementations.memory import MemoryFileSystem

    memory, failures = fsspec.filesystem("memory"), []
    memory.pipe_file("/flaky/a.y4m", b"abc")
    opened = MemoryFileSystem.open

    def flaky(self, path, *given, **named):
        if len(failures) < 2:
            failures.append(path)
            raise ConnectionResetError("the connection was reset")
        return opened(self, path, *given, **named)

    monkeypatch.setattr(MemoryFileSystem, "open", flaky)
    monkeypatch.setattr("time.sleep", lambda _: None)
    copy = fetch("memory://flaky/a.y4m", tmp_path, {}, 3)
    assert pathlib.Path(copy).read_bytes() == b"abc" and len(failures) == 2
    with pytest.raises(pursuit.InputError, match="memory://flaky/none.y4m cannot be fetched"):
        fetch("memory://flaky/none.y4m", tmp_path, {}, 3)


def test_what_a_killed_task_left_is_removed_by_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    left = tmp_path / f"pursuit-ray-{os.getuid()}" / "left"
    left.mkdir(parents=True)
    (left / "clip.mp4").write_bytes(b"x")
    os.utime(left, (1, 1))
    with Scratch() as busy:
        held = busy.folder()
        os.utime(held.parent, (1, 1))
        with Scratch() as other:
            other.folder()
            assert held.is_dir() and not left.exists()


def test_what_makes_no_sense_is_told_before_anything_is_begun(tmp_path):
    for manifest, words in [
        (tmp_path / "none.jsonl", "cannot be read"),
        ([], "there are no clips"),
        ([{"input": 3}], "line 1"),
        ([{"input": "a", "out": "b"}], "belongs to the batch"),
        (str(tmp_path / "*.mp4"), "no file matches"),
        (["a\nb"], "one line"),
        ([3], "not a int"),
    ]:
        with pytest.raises(pursuit.UsageError, match=words):
            pursuit.ray.batch(manifest, tmp_path / "out")
    with pytest.raises(pursuit.UsageError, match="no tracker called"):
        pursuit.ray.batch(["scene:drift"], tmp_path / "out", tracker="kfc")
    with pytest.raises(pursuit.UsageError, match="no folder for results"):
        pursuit.ray.batch(["scene:drift"], "-")
    assert not (tmp_path / "out").exists()
    assert [is_elsewhere(a) for a in ("a.mp4", "s3://b/c", "rtsp://h/1", "scene:drift", "camera:0", "https://h/c")] == [
        False, True, False, False, False, True,
    ]  # fmt: skip


def test_credentials_of_addresses_are_shown_nowhere():
    address = "http://user:sesame@127.0.0.1:9/a.mp4"
    (clip,) = _native.batch_jobs(address, "given", {})
    assert clip[1] == address and "sesame" not in clip[3]
    assert "sesame" not in _native.batch_failed(clip, f"{address} cannot be fetched")
