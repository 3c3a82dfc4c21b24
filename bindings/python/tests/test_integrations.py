"""TraX by hand and by its own client, the VOT and GOT-10k toolkits; what is not installed is skipped."""

import csv
import io
import pathlib
import subprocess
import sys

import numpy as np
import pursuit
import pytest
from conftest import moving_square, overlap
from pictures import png
from pursuit.integrations import trax


#: The VOT toolkit's command. attributee 0.1.10, which it needs, uses this decorator wrongly where Python has it (3.11 on).
VOT = [sys.executable, "-c", "import typing; vars(typing).pop('dataclass_transform', None); from vot.__main__ import main; main()"]


def pictures(folder, frames=20):
    images, boxes = moving_square(frames=frames, color=True)
    folder.mkdir(parents=True, exist_ok=True)
    for k, image in enumerate(images):
        (folder / f"{k + 1:08}.png").write_bytes(png(np.ascontiguousarray(image)))
    return sorted(folder.glob("*.png")), images, boxes


def test_messages_are_read_as_they_are_written():
    line = "@@TRAX:frame " + " ".join(trax.quoted(t) for t in ('file:///a "b".png', "back\\slash", "key=va=lue")) + "\n"
    assert trax.parse(line) == ("frame", ['file:///a "b".png', "back\\slash"], {"key": "va=lue"})
    assert trax.parse("anything else") is None
    assert trax.path_of("file:///a%20b.png") == "/a b.png" and trax.path_of("/c.png") == "/c.png"
    assert trax.region_of("1,2,3,4") == (1, 2, 3, 4)
    assert trax.region_of("0,0,10,1,9,8,-1,5") == (-1, 0, 11, 8)
    for bad in ("", "1,2", "a,b,c,d", "1,2,3,4,5"):
        with pytest.raises(trax.TraxError):
            trax.region_of(bad)


def test_a_conversation(tmp_path):
    paths, images, boxes = pictures(tmp_path)
    said = [f'@@TRAX:initialize "file://{paths[0]}" "{",".join(map(str, boxes[0]))}" "seed=1"\n', "noise\n"]
    said += [f'@@TRAX:frame "{p}"\n' for p in paths[1:]] + ["@@TRAX:quit\n"]
    reader, writer = io.BytesIO("".join(said).encode()), io.BytesIO()
    from pursuit.integrations.vot import serve

    serve(trax.Server("kcf", reader=reader, writer=writer), pursuit.Tracker("kcf"))
    lines = [trax.parse(line) for line in writer.getvalue().decode().splitlines()]
    assert lines[0][0] == "hello" and lines[0][2]["trax.version"] == "3"
    assert [name for name, *_ in lines[1:]] == ["state"] * 20
    expected = pursuit.Tracker("kcf")
    expected.init(images[0], boxes[0])
    for (_, (region,), properties), image in zip(lines[2:], images[1:]):
        estimate = expected.update(image)
        assert trax.region_of(region) == estimate.box
        assert float(properties["confidence"]) == pytest.approx(estimate.score, abs=1e-6)


def test_what_is_no_conversation_ends_with_a_message(tmp_path):
    program = [sys.executable, "-m", "pursuit.integrations.vot"]
    ended = subprocess.run([*program, "kfc"], capture_output=True, text=True)
    assert ended.returncode == 1 and "no tracker called `kfc`" in ended.stderr
    ended = subprocess.run([*program, "kcf"], input='@@TRAX:dance "a"\n', capture_output=True, text=True)
    assert ended.returncode == 1 and "dance" in ended.stderr and "@@TRAX:quit" in ended.stdout
    ended = subprocess.run([*program, "kcf"], input='@@TRAX:initialize "/no.png" "1,2,3,4"\n', capture_output=True, text=True)
    assert ended.returncode == 1 and "/no.png" in ended.stderr
    ini = subprocess.run([*program, "--ini"], capture_output=True, text=True, check=True).stdout
    assert all(f"[pursuit-{name}]" in ini for name in pursuit.trackers)


@pytest.fixture
def stack(tmp_path):
    """A workspace of the VOT toolkit with two small sequences and all our trackers."""
    import typing

    vars(typing).pop("dataclass_transform", None)
    pytest.importorskip("vot")
    import yaml

    for name in ("one", "two"):
        folder = tmp_path / "sequences" / name
        paths, _, boxes = pictures(folder / "color")
        (folder / "groundtruth.txt").write_text("\n".join(",".join(map(str, b)) for b in boxes) + "\n")
        facts = {"channels.color": "color/%08d.png", "format": "default", "fps": 30, "length": len(paths), "width": 160, "height": 120, "name": name}
        (folder / "sequence").write_text("".join(f"{k}={v}\n" for k, v in facts.items()))
    (tmp_path / "sequences" / "list.txt").write_text("one\ntwo\n")
    from pursuit.integrations.vot import entries

    (tmp_path / "trackers.ini").write_text(entries())
    stack = {"title": "small", "dataset": None, "experiments": {"baseline": {"type": "unsupervised", "repetitions": 1, "analyses": [{"type": "average_accuracy", "name": "accuracy"}]}}}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"stack": stack, "registry": ["./trackers.ini"], "sequences": "sequences"}))
    return tmp_path


def test_the_vot_toolkit_s_own_test_of_trackers(stack):
    program = [*VOT, "--registry", str(stack / "trackers.ini"), "test", "pursuit-kcf"]
    ended = subprocess.run(program, capture_output=True, text=True, cwd=stack, timeout=120)
    output = ended.stdout + ended.stderr
    assert ended.returncode == 0 and "Test concluded" in output, output


def test_the_vot_toolkit_evaluates_us(stack):
    program = [*VOT, "evaluate", "--workspace", str(stack), "pursuit-kcf"]
    ended = subprocess.run(program, capture_output=True, text=True, cwd=stack, timeout=300)
    output = ended.stdout + ended.stderr
    results = sorted((stack / "results").glob("pursuit-kcf/baseline/*/*_001.*"))
    assert ended.returncode == 0 and results, output
    from vot.region.io import read_trajectory

    boxes = moving_square(frames=20)[1]
    text = [p for p in (stack / "results").glob("pursuit-kcf/baseline/one/one_001.*") if p.suffix in (".bin", ".txt")]
    trajectory = read_trajectory(str(text[0]))
    found = pursuit.Tracker("kcf")
    paths = sorted((stack / "sequences" / "one" / "color").glob("*.png"))
    found.init(paths[0], boxes[0])
    for path, region in zip(paths[1:], trajectory[1:]):
        box = found.update(path).box
        np.testing.assert_allclose((region.x, region.y, region.width, region.height), box, atol=2e-2)


def test_the_got10k_toolkit_runs_us_and_its_figures_are_ours(tmp_path, command):
    pytest.importorskip("got10k")
    got10k(tmp_path, command)


def got10k(tmp_path, command):
    import json

    if not hasattr(np, "float"):
        np.float = float  # the toolkit is older than numpy 1.24
    from got10k.datasets import GOT10k
    from got10k.utils.metrics import rect_iou
    from pursuit.integrations.got10k import GOT10kTracker

    for name in ("GOT-10k_Val_000001", "GOT-10k_Val_000002"):
        folder = tmp_path / "data" / "val" / name
        paths, _, boxes = pictures(folder, frames=25)
        for k, path in enumerate(paths):
            path.rename(folder / f"{k + 1:08}.jpg")  # the toolkit looks for this ending; readers go by what is inside
        (folder / "groundtruth.txt").write_text("\n".join(",".join(f"{v:.4f}" for v in b) for b in boxes) + "\n")
        for extra, value in (("absence", 0), ("cover", 8), ("cut_by_image", 0)):
            (folder / f"{extra}.label").write_text(f"{value}\n" * len(paths))
        (folder / "meta_info.ini").write_text("[METAINFO]\nresolution: (160, 120)\n")
    (tmp_path / "data" / "val" / "list.txt").write_text("GOT-10k_Val_000001\nGOT-10k_Val_000002\n")
    dataset = GOT10k(str(tmp_path / "data"), subset="val", return_meta=False)
    folder = pathlib.Path(tmp_path / "data" / "val")
    results = pursuit.eval(folder, ["kcf"], out=tmp_path / "out", report=False)
    mean = results["trackers"]["kcf"]["mean"]
    kept = sorted((tmp_path / "out" / "boxes" / "kcf").rglob("*.csv"))
    assert len(kept) == 2
    tracker, overlaps = GOT10kTracker("kcf"), []
    for (files, truth), path in zip(dataset, kept):
        boxes, times = tracker.track(files, truth[0])
        assert len(boxes) == len(times) == 25 and overlap(boxes[-1], truth[-1]) > 0.5
        with path.open() as file:
            ours = np.array([[float(row[k]) for k in "xywh"] for row in csv.DictReader(file)])
        np.testing.assert_allclose(boxes, ours, atol=1e-3)  # files keep three decimals
        overlaps.append(rect_iou(ours, truth)[1:])
    # Of the same boxes the same figure.
    assert mean["average_overlap"] == pytest.approx(np.mean([o.mean() for o in overlaps]), abs=1e-6)
    subprocess.run([command, "-q", "eval", str(folder), "--trackers", "kcf", "--out", str(tmp_path / "c"), "--no-report"], check=True)
    theirs = json.loads((tmp_path / "c" / "results.json").read_text())
    assert theirs["trackers"]["kcf"]["mean"]["average_overlap"] == mean["average_overlap"]
