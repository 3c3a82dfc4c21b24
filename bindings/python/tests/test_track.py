"""Whole inputs, and the command beside them."""

import csv
import itertools
import json
import pathlib
import subprocess
import sys

import numpy as np
import pursuit
import pytest
from conftest import ROOT, moving_square
from pictures import png
from pursuit._track import COLUMNS

CLIPS = ROOT.parent / "shared" / "data"


def by_command(command, folder, input, *options):
    arguments = [command, "-q", "track", input, "--out", str(folder), "--no-video", "--format", "jsonl", *options]
    subprocess.run(arguments, check=True, capture_output=True)
    lines = (folder / "trajectory.jsonl").read_text().splitlines()
    rows = list(csv.DictReader((folder / "trajectory.csv").open()))
    return [json.loads(line) for line in lines], rows


def same(track, objects, rows):
    """To the last digit of what the command writes, and of what it computes."""
    table = track.to_numpy()
    assert len(table) == len(rows) == len(objects) > 0
    for e, row, written in zip(track.estimates, table, rows):
        assert (written["frame"], written["target"], written["state"]) == (str(e.frame), str(e.target), e.state)
        for name in ("x", "y", "w", "h", "pred_x", "pred_y", "meas_x", "meas_w"):
            assert written[name] == ("" if np.isnan(row[name]) else f"{row[name]:.3f}"), (e.frame, name)
        assert written["score"] == f"{e.score:.4f}" and written["time_s"] == f"{e.time_s:.6f}"
    for e, whole in zip(track.estimates, objects):
        assert (list(e.box), e.score) == (whole["box"], whole["score"])
        assert (e.prediction and list(e.prediction)) == whole["prediction"]


@pytest.mark.parametrize("tracker", ["pursuit", "kcf"])
def test_a_scene_is_followed_as_the_command_does(tracker, command, tmp_path):
    input = "scene:occluding-bar?seed=3&duration=2"
    objects, rows = by_command(command, tmp_path, input, "--tracker", tracker)
    same(pursuit.track(input, tracker=tracker), objects, rows)


def test_real_clips_are_followed_as_the_command_does(command, tmp_path):
    clips = sorted(CLIPS.glob("**/*.mp4"))[:1] if CLIPS.is_dir() else []
    if not clips:
        pytest.skip("there is no footage beside the checkout")
    box, options = (100, 80, 60, 60), ("--box", "100,80,60,60", "--to", "60", "--tracker", "kcf")
    objects, rows = by_command(command, tmp_path, str(clips[0]), *options)
    same(pursuit.track(clips[0], box, tracker="kcf", end=60), objects, rows)


def test_parameters_and_parts_of_the_input(command, tmp_path):
    input = "scene:drift?seed=3&duration=2"
    options = ("--tracker", "kcf", "--set", "motion.model=imm", "--from", "5", "--stride", "2", "--region", "20,20,260,180")
    objects, rows = by_command(command, tmp_path, input, *options)
    track = pursuit.track(input, tracker="kcf", motion="imm", start=5, stride=2, region=(20, 20, 260, 180))
    same(track, objects, rows)


def test_files_are_left_where_a_folder_is_named(tmp_path):
    track = pursuit.track("scene:drift?duration=1", tracker="mosse", out=tmp_path / "run", video=False).run()
    assert (tmp_path / "run" / "trajectory.csv").is_file()
    assert track.facts["status"] == "done" and track.facts["frame_count"] == len(track) == 30


def test_nothing_is_written_otherwise(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pursuit.track("scene:drift?duration=1", tracker="mosse").run()
    assert list(tmp_path.iterdir()) == []


def test_results_as_tables_and_pictures():
    track = pursuit.track("scene:drift?duration=1", tracker="mosse")
    table = track.to_numpy()
    assert table.dtype.names[:4] == ("frame", "time_s", "target", "state") and len(table) == 30
    assert track.boxes().shape == (30, 4)
    assert track.states() == {"tracking": 30, "unsure": 0, "occluded": 0, "lost": 0}
    html = track._repr_html_()
    assert html.count("data:image/jpeg;base64,") == html.count("<rect") == 30 and "30 tracking" in html
    assert 'max="29"' in html and 'data-said="frame 0, 0.00 s: tracking, score 1.00"' in html
    pandas = pytest.importorskip("pandas")
    assert isinstance(track.to_pandas(), pandas.DataFrame)


def test_pictures_for_notebooks_are_spread_over_the_clip():
    def pictures(**part):
        track = pursuit.track("scene:drift?duration=4", tracker="mosse", **part).run()
        return track._clip.pictures

    shown, place = pictures()
    frames = [frame for frame, _ in shown]
    assert frames == list(range(0, 120, 4)) and shown[0][1][:2] == b"\xff\xd8" and place == [0, 0, 1, 1]
    _, place = pictures(region=(20, 40, 300, 200), resize=0.5)
    assert place == pytest.approx([20, 40, 2, 2])


def test_progress_is_said(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    pursuit.track("scene:drift?duration=1", tracker="mosse", progress=True).run()
    assert capsys.readouterr().err.splitlines()[-1].startswith("scene:drift?duration=1: 30 of 30 frames, ")
    pursuit.track("scene:drift?duration=1", tracker="mosse").run()
    assert capsys.readouterr().err == ""


def test_other_packages_tables():
    polars = pytest.importorskip("polars")
    table = pursuit.track("scene:drift?duration=1", tracker="mosse").to_polars()
    assert isinstance(table, polars.DataFrame) and table["pred_x"].null_count() == 1


def test_the_dataset_of_a_batch_is_read_by_others(command, tmp_path):
    parquet = pytest.importorskip("pyarrow.dataset")
    list_of_clips = tmp_path / "clips.txt"
    list_of_clips.write_text("scene:drift?seed=1&duration=1\nscene:drift?seed=2&duration=1\n")
    arguments = ["-q", "batch", str(list_of_clips), "--tracker", "mosse", "--out", str(tmp_path / "out"), "--json"]
    said = json.loads(subprocess.run([command, *arguments], check=True, capture_output=True).stdout)
    if not said["dataset"]:
        pytest.skip("this build of the command writes no Parquet")
    table = parquet.dataset(tmp_path / "out" / "dataset", partitioning="hive").to_table().to_pydict()
    assert set(COLUMNS) | {"clip"} == set(table) and len(table["x"]) == 60
    second = [x for x, clip in zip(table["x"], table["clip"]) if "seed-2" in clip]
    assert second == [e.box[0] for e in pursuit.track("scene:drift?seed=2&duration=1", tracker="mosse")]


def test_plots(monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(pursuit.track("scene:drift?duration=1", tracker="mosse").plot()) == 3


def test_arrays_are_followed():
    images, boxes = moving_square()
    track = pursuit.track(np.stack(images), boxes[0], tracker="kcf")
    assert len(track) == 40
    both = pursuit.track(iter(images), [boxes[0], (100, 80, 20, 20)], tracker="kcf").run()
    assert [e.target for e in both.estimates[:4]] == [1, 2, 1, 2]


def known(track):
    return [(e.frame, e.time_s, e.target, e.state, e.box, e.score) for e in track]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Frames in a folder, the same as arrays, and the true boxes."""
    images, boxes = moving_square(color=True)
    folder = tmp_path_factory.mktemp("clip")
    for k, image in enumerate(images):
        (folder / f"{k:04}.png").write_bytes(png(image))
    return folder, images, boxes


@pytest.mark.parametrize(
    "options",
    [
        dict(tracker="kcf", motion="imm"),
        dict(tracker="mosse", start=2, end=30, stride=3),
        dict(tracker="kcf", region=(11, 21, 140, 90)),
        dict(tracker="kcf", region=(0, 10, 160, 100), resize=0.5),
        dict(tracker="kcf", resize=(240, 180)),
        dict(detect="motion", many=True),
    ],
)
def test_arrays_are_followed_as_files_are(clip, options):
    folder, images, boxes = clip
    box = None if "detect" in options else boxes[options.get("start", 0)]
    of_files = known(pursuit.track(folder, box, fps=25, **options))
    assert known(pursuit.track(iter(images), box, fps=25, **options)) == of_files != []
    assert known(pursuit.track(np.stack(images), box, fps=25, **options)) == of_files


def test_arrays_leave_the_files_of_a_run(clip, tmp_path):
    _, images, boxes = clip
    track = pursuit.track(iter(images), boxes[0], tracker="kcf", out=tmp_path / "a", overlay="minimal", formats=["jsonl"])
    assert len(track) == 40 and (tmp_path / "a" / "trajectory.csv").is_file()
    written = json.loads((tmp_path / "a" / "trajectory.jsonl").read_text().splitlines()[-1])
    assert list(track.estimates[-1].box) == written["box"]
    assert track.facts["frame_count"] == 40 and track.facts["input"]["name"] == "arrays"


def test_a_generator_may_use_its_memory_again(clip):
    _, images, boxes = clip
    buffer, asked = np.empty_like(images[0]), []

    def frames():
        for k, image in enumerate(images):
            buffer[:] = image
            asked.append(k)
            yield buffer

    boxes_seen = []
    for e in pursuit.track(frames(), boxes[0], tracker="kcf"):
        assert asked[-1] == e.frame, "no frame is asked for before the last is done with"
        boxes_seen.append(e.box)
    assert boxes_seen == [e.box for e in pursuit.track(images, boxes[0], tracker="kcf")]


def test_what_a_generator_raises_ends_the_run(clip, tmp_path):
    _, images, boxes = clip

    def torn():
        yield from images[:20]
        raise KeyError("no more")

    track = pursuit.track(torn(), boxes[0], tracker="kcf", out=tmp_path / "run", video=False)
    with pytest.raises(KeyError, match="no more"):
        track.run()
    facts = json.loads((tmp_path / "run" / "run.json").read_text())
    assert (len(track.estimates), facts["status"]) == (20, "broken") and "no more" in facts["error"]
    rest = pursuit.track(images, boxes[0], tracker="kcf", out=tmp_path / "run", video=False, resume=True)
    whole = pursuit.track(images, boxes[0], tracker="kcf")
    assert [e.box for e in rest] == [e.box for e in whole][20:]


def test_depth_arrays_go_with_their_frames(clip):
    _, images, boxes = clip
    depths = [np.full((120, 160), 3000, np.uint16) for _ in images]
    for depth, (x, y, w, h) in zip(depths, boxes):
        depth[y : y + h, x : x + w] = 1000
    track = pursuit.track(images, boxes[0], tracker="depth-occlusion", depth=iter(depths))
    assert track.states()["tracking"] == len(track) == 40
    with pytest.raises(pursuit.InputError, match="fewer depth images"):
        pursuit.track(images, boxes[0], tracker="depth-occlusion", depth=depths[:5]).run()


def test_a_track_of_an_endless_generator_is_stopped(clip):
    _, images, boxes = clip
    track = pursuit.track(itertools.repeat(images[0]), boxes[0], tracker="mosse")
    assert next(iter(track)).frame == 0
    track.stop()
    assert len(track) == 1


def test_who_iterates_again_begins_with_the_first():
    track = pursuit.track("scene:drift?seed=7&duration=1", tracker="kcf")
    first = next(iter(track))
    rows = list(track)
    assert len(rows) == len(track) == 30 and rows[0] is first and list(track) == rows
    assert len(list(pursuit.track("scene:drift?seed=7&duration=1", tracker="kcf", progress=True))) == 30


def test_an_iterator_that_is_dropped_ends_its_run():
    track = pursuit.track("scene:drift?duration=600", tracker="mosse")
    assert next(iter(track)).frame == 0
    del track
    track = pursuit.track("scene:drift?duration=600", tracker="mosse")
    for e in track:
        if e.frame == 5:
            track.stop()
            break
    assert len(track) == 6


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        (dict(input="no/such.mp4", box=(1, 2, 3, 4)), pursuit.InputError, "such.mp4"),
        (dict(input="scene:nowhere"), pursuit.UsageError, "nowhere"),
        (dict(input="scene:drift", tracker="kfc"), pursuit.UsageError, "kfc"),
        (dict(input="scene:drift", box=(1, 2)), pursuit.UsageError, "left, top, width, height"),
        (dict(input="scene:drift", learning=2), pursuit.UsageError, "learning"),
        (dict(input="scene:drift", plots=True), pursuit.UsageError, "out="),
        (dict(input="scene:drift", stride=0), pursuit.UsageError, "nonzero"),
        (dict(input=[np.zeros((9, 9), np.uint8)]), pursuit.UsageError, "nothing to track in arrays"),
        (dict(input=[np.zeros((9, 9), np.uint8)]), pursuit.UsageError, '`box=(left, top, width, height)` in pixels'),
        (dict(input=[np.zeros((9, 9), np.uint8)]), pursuit.UsageError, '`detect="ball"`'),
        (dict(input=[], box=(1, 1, 3, 3)), pursuit.InputError, "no frames"),
        (dict(input=[np.zeros((9, 9, 9), np.uint8)], box=(1, 1, 3, 3)), pursuit.InputError, "a frame is an array"),
        (dict(input="scene:drift", depth=[np.zeros((9, 9), np.uint16)]), pursuit.UsageError, "depth arrays"),
        (dict(input="scene:drift", resume=True), pursuit.UsageError, "out="),
        (dict(input="scene:drift", resize="huge"), pursuit.UsageError, "huge"),
    ],
)
def test_errors(given, error, words):
    with pytest.raises(error) as raised:
        pursuit.track(**given).run()
    assert words in str(raised.value) and "\n" not in str(raised.value)


def test_a_file_that_breaks_off_is_told_and_what_was_read_is_kept(tmp_path):
    header = b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 C420\n"
    frame = b"FRAME\n" + bytes(range(256)) * 12 + bytes(1536)
    path = tmp_path / "broken.y4m"
    path.write_bytes(header + 5 * frame + frame[:99])
    track = pursuit.track(path, (10, 10, 20, 20), tracker="mosse")
    with pytest.raises(pursuit.InputError, match="broken.y4m"):
        track.run()
    assert len(track.estimates) == 5


def test_reproduce_and_eval_are_the_command_s(command, tmp_path):
    images, boxes = moving_square(frames=20, color=True)
    folder = tmp_path / "data" / "square"
    folder.mkdir(parents=True)
    lines = ["index,image,x,y,w,h"]
    for k, (image, box) in enumerate(zip(images, boxes)):
        (folder / f"{k:04}.png").write_bytes(png(image))
        lines.append(f"{k},{k:04}.png,{box[0]},{box[1]},{box[2]},{box[3]}")
    (folder / "frames.csv").write_text("\n".join(lines) + "\n")
    ours = pursuit.eval(tmp_path / "data", ["kcf", "mosse"], out=tmp_path / "a", report=False)
    arguments = ["-q", "eval", str(tmp_path / "data"), "--trackers", "kcf,mosse", "--out", str(tmp_path / "b"), "--no-report"]
    subprocess.run([command, *arguments], check=True, capture_output=True)
    theirs = json.loads((tmp_path / "b" / "results.json").read_text())
    for name in ("kcf", "mosse"):
        for figure in ("auc", "precision20", "success50", "average_overlap"):
            assert ours["trackers"][name]["mean"][figure] == theirs["trackers"][name]["mean"][figure]
    with pytest.raises(pursuit.UsageError):
        pursuit.eval(tmp_path / "data", ["kfc"], out=tmp_path / "c")
    with pytest.raises(pursuit.InputError):
        pursuit.eval(tmp_path / "nothing", ["kcf"], out=tmp_path / "c")
    assert pursuit.reproduce("ball", seeds=1)["seeds"] == 1
    with pytest.raises(pursuit.UsageError):
        pursuit.reproduce("nobody2020")


def test_examples_of_the_documentation():
    """The blocks of the guide run as they stand, in one program each."""
    guides = [ROOT / "docs" / "guide" / name for name in ("python.md", "own-tracker.md")]
    pages = (*guides, ROOT / "README.md", ROOT / "bindings" / "python" / "README.md")
    blocks = [b.split("```")[0] for page in pages for b in page.read_text().split("```python\n")[1:]]
    assert len(blocks) >= 6
    for block in blocks:
        subprocess.run([sys.executable, "-c", block], check=True, capture_output=True, cwd=pathlib.Path(__file__).parent)


def test_examples_of_the_docstrings():
    import doctest

    for module in (pursuit, pursuit.estimation, sys.modules["pursuit._track"]):
        result = doctest.testmod(module)
        assert result.failed == 0
        assert result.attempted > 0
