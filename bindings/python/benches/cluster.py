#!/usr/bin/env python3
"""pursuit.ray.batch on this machine: workers killed while it runs, `ray stop` in the midst, the speed of one worker and of two.

usage: cluster.py [kills|stop|speed …] [--clips N] [--seconds S] [--every S]
needs: the wheel with its extra `ray`. Starts and stops Ray; refuses where another Ray is running.

kills: with two and with four workers, one killed every --every seconds, three clips broken: every clip is done once. stop: `ray
stop --force` in the midst, then the same again: nothing is done twice. speed: one worker, two, one, two; broken ones apart.
"""

import argparse
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

RAY = [sys.executable, "-c", "from ray.scripts.scripts import main; main()"]
BROKEN = 3


def manifest(folder, count, seconds, broken=BROKEN):
    (folder / "garbage.mp4").write_bytes(bytes(5000))
    lines = [{"name": f"clip-{k:03}", "input": f"scene:drift?seed={k}&duration={seconds}"} for k in range(count - broken)]
    lines += [{"name": f"broken-{k}", "input": str(folder / "garbage.mp4")} for k in range(broken)]
    path = folder / "clips.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def processes():
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            yield int(process.name), (process / "cmdline").read_bytes()
        except OSError:
            pass


def working():
    return [process for process, line in processes() if line.startswith(b"ray::") and b"_track" in line]


def finished(out):
    return {p.parent.name: p.stat().st_mtime_ns for p in out.glob("clips/clip-*/finished.json")}


def run(clips, out):
    """The batch in a process of its own, which is what connects to the cluster."""
    program = (
        "import json, sys, ray, pursuit.ray\n"
        "ray.init(address='auto', log_to_driver=False, logging_level='error')\n"
        "ray.data.DataContext.get_current().enable_progress_bars = False\n"
        f"s = pursuit.ray.batch({str(clips)!r}, {str(out)!r}, tracker='kcf')\n"
        "print(json.dumps(s))\n"
    )
    return subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def summary(running):
    text, _ = running.communicate()
    if running.returncode:
        sys.exit("the batch broke off")
    return json.loads(text.splitlines()[-1])


def start(workers):
    # By default workers are nice to whatever else runs, 15, which would be measured too.
    os.environ["RAY_worker_niceness"] = "0"
    quiet = dict(stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    subprocess.run([*RAY, "start", "--head", "--port=0", f"--num-cpus={workers}", "--include-dashboard=false", "--disable-usage-stats"], check=True, **quiet)


def stop(force=False):
    subprocess.run([*RAY, "stop", *(["--force"] if force else [])], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


class Watch(threading.Thread):
    """Notes when clips were finished, and kills a worker every so often."""

    def __init__(self, out, every=None):
        super().__init__(daemon=True)
        self.out, self.every = out, every
        self.seen, self.twice, self.killed, self.over = {}, set(), 0, threading.Event()

    def run(self):
        next_kill = time.monotonic() + (self.every or 0)
        while not self.over.wait(0.1):
            for name, at in finished(self.out).items():
                if self.seen.setdefault(name, at) != at:
                    self.twice.add(name)
            if self.every and time.monotonic() >= next_kill and (at_work := working()):
                os.kill(at_work[0], signal.SIGKILL)
                self.killed += 1
                next_kill += self.every

    def end(self):
        self.over.set()
        self.join()


def kills(a, folder):
    clips = manifest(folder, a.clips, a.seconds)
    for workers in (2, 4):
        out = folder / f"kills-{workers}"
        start(workers)
        watch = Watch(out, a.every)
        watch.start()
        began = time.monotonic()
        s = summary(run(clips, out))
        watch.end()
        stop()
        good = len(s["clips"]) == a.clips - BROKEN and len(s["failed"]) == BROKEN and not watch.twice and not s["left"]
        print(f"{workers} workers, one killed every {a.every:g} s ({watch.killed} in all): {len(s['clips'])} done, {len(s['failed'])} broken, "
              f"{len(watch.twice)} done twice, {time.monotonic() - began:.1f} s: {'as it should be' if good else 'WRONG'}", flush=True)
        yield good and watch.killed > 0


def interrupted(a, folder):
    clips, out = manifest(folder, a.clips, a.seconds), folder / "stop"
    start(2)
    running = run(clips, out)
    while len(finished(out)) < a.clips // 3 and running.poll() is None:
        time.sleep(0.1)
    stop(force=True)
    running.kill()
    running.wait()
    before = finished(out)
    start(2)
    s = summary(run(clips, out))
    stop()
    after = finished(out)
    again = sum(after[name] != at for name, at in before.items())
    good = again == 0 and 0 < len(before) < a.clips - BROKEN and s["earlier"] == len(before) and len(after) == a.clips - BROKEN
    print(f"ray stop after {len(before)} clips, then the same call: {s['earlier']} were done, {again} were done again, "
          f"{len(s['clips'])} done in the end: {'as it should be' if good else 'WRONG'}", flush=True)
    yield good


def speed(a, folder):
    clips, took = manifest(folder, a.clips, a.seconds, broken=0), {1: [], 2: []}
    for turn in range(2):
        for workers in (1, 2):
            out = folder / f"speed-{workers}"
            start(workers)
            # Ray starts its workers in the first batch: that is not what is measured.
            summary(run(manifest(folder, 8, 1, broken=0), folder / "warm"))
            clips = manifest(folder, a.clips, a.seconds, broken=0)
            s = summary(run(clips, out))
            stop()
            took[workers].append(s["seconds"])
            busy = sum(c["seconds"] for c in s["clips"])
            print(f"{workers} worker(s): {s['seconds']:.1f} s for {len(s['clips'])} clips, {busy:.1f} s of it in clips", flush=True)
            shutil.rmtree(out)
            shutil.rmtree(folder / "warm")
    ratio = min(took[1]) / min(took[2])
    print(f"two workers are {ratio:.2f} times as fast as one, {ratio / 2:.0%} of the ideal (best of two turns each)", flush=True)
    yield True


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parts = {"kills": kills, "stop": interrupted, "speed": speed}
    parser.add_argument("what", nargs="*", help="kills, stop, speed; all without")
    parser.add_argument("--clips", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=8, help="length of a clip")
    parser.add_argument("--every", type=float, default=20, help="seconds from kill to kill")
    a = parser.parse_args()
    if any(b"raylet" in line.split(b"\0")[0] for _, line in processes()):
        sys.exit("another Ray is running on this machine, which `ray stop` would end")
    good = True
    with tempfile.TemporaryDirectory() as temporary:
        for what in a.what or parts:
            for part in parts[what](a, pathlib.Path(temporary)):
                good &= part
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
