"""Long runs leave nothing behind."""

import gc
import os
import tracemalloc

import numpy as np
import pursuit
import pytest
from conftest import moving_square

FRAMES = 10_000


def resident():
    """Bytes of this process in memory."""
    try:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        pytest.skip("this system does not say how much memory a process has")


def test_ten_thousand_frames_leak_nothing():
    images, boxes = moving_square(frames=20, step=(0, 0), color=True)
    bgr = pursuit.Tracker("mosse", channels="bgr")
    grey = pursuit.Tracker("mosse")
    bgr.init(images[0], boxes[0])
    grey.init(images[0][..., 0], boxes[0])

    def some(count):
        for k in range(count):
            image = images[k % 20]
            estimate = bgr.update(image)  # copied
            grey.update(image[..., 0])  # strided: copied
            grey.update(np.ascontiguousarray(image[..., 0]))  # borrowed
            assert estimate.covariance is not None and estimate.diagnostics is not None
            if k % 10 == 0:
                pursuit.Tracker.restore(grey.save())
                with pytest.raises(pursuit.InputError):
                    grey.update(image[:30])

    some(FRAMES // 10)
    gc.collect()
    tracemalloc.start()
    before, resident_before = tracemalloc.get_traced_memory()[0], resident()
    some(FRAMES)
    gc.collect()
    after, resident_after = tracemalloc.get_traced_memory()[0], resident()
    tracemalloc.stop()
    # One image of these is 58 kB, ten thousand are 576 MB.
    assert after - before < 100_000
    assert resident_after - resident_before < 8_000_000


def test_whole_runs_and_batches_leave_no_threads_and_no_memory():
    def once():
        pursuit.track("scene:drift?duration=1", tracker="mosse").run()
        iterator = iter(pursuit.track("scene:drift?duration=100", tracker="mosse"))
        next(iterator)

    once()
    gc.collect()
    threads = len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else 0
    for _ in range(20):
        once()
    gc.collect()
    if threads:
        import time

        deadline = time.monotonic() + 20
        while len(os.listdir("/proc/self/task")) > threads + 2 and time.monotonic() < deadline:
            time.sleep(0.1)
        assert len(os.listdir("/proc/self/task")) <= threads + 2


def test_what_is_handed_out_says_what_it_is():
    from importlib import metadata

    try:
        files = metadata.files("pursuit-tracking")
    except metadata.PackageNotFoundError:
        pytest.skip("the package is not installed")
    names = {str(f).rsplit("/", 1)[-1] for f in files}
    assert {"NOTICES.txt", "LICENSE-MIT", "LICENSE-APACHE", "py.typed", "_native.pyi"} <= names
    assert metadata.version("pursuit-tracking") == pursuit.__version__
    notices = next(f for f in files if f.name == "NOTICES.txt").read_text()
    assert "pyo3 " in notices and "numpy " in notices
    required = [r for r in metadata.requires("pursuit-tracking") if "extra" not in r]
    assert len(required) == 1 and required[0].startswith("numpy")
