"""The toolkits on real footage, and their figures beside ours of the same boxes; what is not there is skipped."""

import csv
import json
import pathlib
import subprocess
import sys

import numpy as np
import pursuit
import pytest
from conftest import ROOT, moving_square, overlap
from pictures import png
from test_integrations import VOT

DATA = ROOT.parent / "shared" / "data"
SEQUENCES = ("SegTrack2_monkeydog", "SegTrack2_parachute", "SegTrack2_soldier")
# Without a supervised experiment: the toolkit's (0.9.0) hands a single object to its runtime, which asks for a list, and so runs no tracker.
STACK = {
    "title": "footage",
    "dataset": None,
    "experiments": {
        # The first frame is where trackers are started: it does not count here, nor in `pursuit eval`.
        "baseline": {
            "type": "unsupervised",
            "analyses": [{"type": "average_accuracy", "weighted": False, "burnin": 1, "bounded": False}],
        },
    },
}


def facts(name, length, width, height):
    known = {"channels.color": "color/%08d.png", "format": "default", "fps": 30, "length": length, "width": width, "height": height, "name": name}
    return "".join(f"{k}={v}\n" for k, v in known.items())


def vot(stack, *arguments):
    ended = subprocess.run([*VOT, *arguments], capture_output=True, text=True, cwd=stack, timeout=600)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout + ended.stderr


@pytest.fixture
def workspace(tmp_path):
    """Makes a workspace of the toolkit with these experiments, and all our trackers."""
    import typing

    vars(typing).pop("dataclass_transform", None)
    pytest.importorskip("vot")
    import yaml
    from pursuit.integrations.vot import entries

    def make(stack, names, many=False):
        (tmp_path / "trackers.ini").write_text(entries(many=many))
        (tmp_path / "config.yaml").write_text(yaml.safe_dump({"stack": stack, "registry": ["./trackers.ini"], "sequences": "sequences"}))
        (tmp_path / "sequences" / "list.txt").write_text("".join(f"{name}\n" for name in names))
        return tmp_path

    return make


@pytest.fixture
def footage(tmp_path, workspace):
    """A stack of a few sequences of real footage."""
    if not (DATA / "sot2").is_dir():
        pytest.skip(f"no footage in {DATA / 'sot2'}")
    cv2 = pytest.importorskip("cv2")
    for name in SEQUENCES:
        folder = tmp_path / "sequences" / name
        (folder / "color").mkdir(parents=True)
        video, count = cv2.VideoCapture(str(DATA / "sot2" / f"{name}.mp4")), 0
        while (read := video.read())[0]:
            count += 1
            cv2.imwrite(str(folder / "color" / f"{count:08}.png"), read[1])
        with (DATA / "sot2" / f"{name}.csv").open() as file:
            boxes = [[float(row[k]) for k in "xywh"] for row in csv.DictReader(file)]
        assert len(boxes) == count
        (folder / "groundtruth.txt").write_text("".join(",".join(f"{v:g}" for v in box) + "\n" for box in boxes))
        (folder / "sequence").write_text(facts(name, count, int(video.get(3)), int(video.get(4))))
    return workspace(STACK, SEQUENCES)


def figures(stack, name):
    """What `vot analysis` says of the one tracker, by experiment."""
    vot(stack, "analysis", "--workspace", str(stack), "--name", name, "pursuit-kcf")
    found = json.loads((stack / "analysis" / f"{name}.json").read_text())["results"]
    return {experiment: known["results"][0][0] for experiment, known in found.items()}


def kept(out, name):
    (path,) = (out / "boxes" / "kcf").rglob(f"{name}*.csv")
    with path.open() as file:
        return np.array([[float(row[k]) for k in "xywh"] for row in csv.DictReader(file)])


def test_vot_on_footage_has_the_boxes_of_eval_and_their_overlaps(footage, tmp_path):
    vot(footage, "evaluate", "--workspace", str(footage), "pursuit-kcf")
    from vot.region.io import read_trajectory

    out = tmp_path / "ope"
    pursuit.eval(footage / "sequences", ["kcf"], out=out, report=False)
    means = []
    for name in SEQUENCES:
        folder = footage / "results" / "pursuit-kcf" / "baseline" / name
        (path,) = (p for p in folder.glob(f"{name}_001.*") if p.suffix in (".bin", ".txt"))
        boxes = np.array([(r.x, r.y, r.width, r.height) for r in read_trajectory(str(path))[1:]])
        # TraX rounds the box that starts a tracker to four decimals, and the toolkit's own library keeps single precision.
        np.testing.assert_allclose(boxes, kept(out, name)[1:], atol=2e-2)
        # Now the very boxes of eval.
        path.unlink()
        text = "1\n" + "".join(",".join(f"{v:.3f}" for v in box) + "\n" for box in kept(out, name)[1:])
        (folder / f"{name}_001.txt").write_text(text)
        truth = np.loadtxt(footage / "sequences" / name / "groundtruth.txt", delimiter=",")
        means.append(np.mean([overlap(a, b) for a, b in zip(kept(out, name)[1:], truth[1:])]))
    theirs = figures(footage, "same")
    (accuracy,) = theirs["baseline"]
    # The toolkit counts pixels, where boxes end between them too. What `pursuit eval` itself reports counts the box of a lost target as none.
    assert accuracy == pytest.approx(np.mean(means), abs=2e-3)


def test_vot_follows_several_objects(tmp_path, workspace):
    images, boxes = moving_square(frames=15, color=True)
    folder = tmp_path / "sequences" / "pair"
    (folder / "color").mkdir(parents=True)
    # The other square is the first, mirrored; it comes later.
    for k, image in enumerate(images):
        both = np.maximum(image, image[:, ::-1])
        (folder / "color" / f"{k + 1:08}.png").write_bytes(png(np.ascontiguousarray(both)))
    other = [(160 - x - w, y, w, h) for x, y, w, h in boxes]
    line = "{},{},{},{}\n".format
    (folder / "groundtruth_a.txt").write_text("".join(line(*b) for b in boxes))
    (folder / "groundtruth_b.txt").write_text("".join(line(*b) for b in other))
    (folder / "sequence").write_text(facts("pair", len(images), 160, 120))
    stack = {"title": "several", "dataset": None, "experiments": {"baseline": {"type": "unsupervised", "multiobject": True, "analyses": [{"type": "average_accuracy"}]}}}
    home = workspace(stack, ["pair"], many=True)
    assert "Test concluded" in vot(home, "--registry", str(home / "trackers.ini"), "test", "pursuit-kcf-many")
    vot(home, "evaluate", "--workspace", str(home), "pursuit-kcf-many")
    from vot.region.io import read_trajectory

    paths = sorted((folder / "color").glob("*.png"))
    for name, truth in (("a", boxes), ("b", other)):
        (path,) = (p for p in (home / "results").rglob(f"pair_{name}_001.*") if p.suffix in (".bin", ".txt"))
        alone = pursuit.Tracker("kcf")
        alone.init(paths[0], truth[0])
        for picture, region in zip(paths[1:], read_trajectory(str(path))[1:]):
            np.testing.assert_allclose((region.x, region.y, region.width, region.height), alone.update(picture).box, atol=2e-2)


def test_objects_that_are_named_later_join(tmp_path):
    import io

    from pursuit.integrations import trax
    from pursuit.integrations.vot import serve_many

    images, boxes = moving_square(frames=6)
    paths = [tmp_path / f"{k}.png" for k in range(6)]
    for path, image in zip(paths, images):
        path.write_bytes(png(np.repeat(image[..., None], 3, axis=2)))
    region = lambda box: ",".join(map(str, box))
    said = [f'@@TRAX:initialize "{region(boxes[0])}"\n', f'@@TRAX:frame "file://{paths[0]}"\n', f'@@TRAX:frame "{paths[1]}"\n']
    said += [f'@@TRAX:initialize "{region(boxes[2])}"\n', f'@@TRAX:initialize "10,10,20,20"\n', f'@@TRAX:frame "{paths[2]}"\n']
    said += [f'@@TRAX:frame "{paths[3]}"\n', "@@TRAX:quit\n"]
    reader, writer = io.BytesIO("".join(said).encode()), io.BytesIO()
    serve_many(trax.Server("kcf", many=True, reader=reader, writer=writer), pursuit.MultiTracker("kcf"))
    lines = [trax.parse(line) for line in writer.getvalue().decode().splitlines()]
    assert lines[0][2]["trax.version"] == "4" and lines[0][2]["trax.multiobject"] == "1"
    assert [name for name, *_ in lines[1:]] == ["state"] * (1 + 1 + 3 + 3)
    assert trax.region_of(lines[4][1][0]) == boxes[2] and trax.region_of(lines[5][1][0]) == (10, 10, 20, 20)
    reader = io.BytesIO(f'@@TRAX:initialize "{paths[0]}" "1,2,3,4"\n'.encode())
    with pytest.raises(trax.TraxError, match="2 arguments"):
        serve_many(trax.Server("kcf", many=True, reader=reader, writer=io.BytesIO()), pursuit.MultiTracker("kcf"))
