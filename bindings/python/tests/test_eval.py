"""`pursuit.eval` on trackers and results that are not ours."""

import csv
import json

import numpy as np
import pytest

import pursuit
from conftest import moving_square
from pictures import png


@pytest.fixture
def data(tmp_path):
    """Two sequences of ten frames: a grey film with its truth, and a folder of pictures in colour."""
    folder = tmp_path / "data" / "color"
    folder.mkdir(parents=True)
    images, boxes = moving_square(frames=10)
    film = b"YUV4MPEG2 W160 H120 F25:1 Cmono\n" + b"".join(b"FRAME\n" + image.tobytes() for image in images)
    (tmp_path / "data" / "gray.y4m").write_bytes(film)
    rows = [f"{k}," + ",".join(map(str, box)) for k, box in enumerate(boxes)]
    (tmp_path / "data" / "gray.csv").write_text("\n".join(["index,x,y,w,h", *rows]) + "\n")
    lines = ["index,image,x,y,w,h"]
    for k, (image, box) in enumerate(zip(moving_square(frames=10, color=True)[0], boxes)):
        image[..., 2] //= 2
        (folder / f"{k}.png").write_bytes(png(image))
        lines.append(f"{k},{k}.png," + ",".join(map(str, box)))
    (folder / "frames.csv").write_text("\n".join(lines) + "\n")
    return tmp_path / "data"


class Still:
    """Says the box that it was given, in whatever form it is told to."""

    form = staticmethod(lambda box: box)
    shapes = []

    def init(self, frame, box):
        self.box = box
        Still.shapes.append((frame.shape, frame.dtype))

    def update(self, frame):
        return type(self).form(self.box)


def run(data, tmp_path, trackers, **options):
    return pursuit.eval(data, trackers, out=tmp_path / "out", report=False, **options)


def test_trackers_of_python_are_measured_beside_ours(data, tmp_path):
    Still.shapes.clear()
    results = run(data, tmp_path, [Still, "kcf"])["trackers"]
    assert sorted(Still.shapes) == [((120, 160), np.uint8), ((120, 160, 3), np.uint8)]
    assert results["Still"]["mean"]["sequences"] == 2
    assert 0 < results["Still"]["mean"]["auc"] < results["kcf"]["mean"]["auc"]
    assert results["Still"]["sequences"]["gray"]["update"]["count"] == 9


@pytest.mark.parametrize(
    ("form", "state", "score"),
    [
        (lambda box: [float(v) for v in box], "tracking", 1.0),
        (lambda box: np.array(box), "tracking", 1.0),
        (lambda box: (True, box), "tracking", 1.0),
        (lambda box: (np.bool_(False), box), "lost", 0.0),
        (lambda box: (box, 0.25), "tracking", 0.25),
        (lambda box: None, "lost", 0.0),
    ],
)
def test_answers_in_any_usual_form(data, tmp_path, form, state, score):
    tracker = type("Formed", (Still,), {"form": staticmethod(form)})
    run(data, tmp_path, {"mine": tracker}, sequences="gray")
    with (tmp_path / "out/boxes/mine/gray.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    assert (last["state"], float(last["score"])) == (state, score)
    assert float(last["x"]) == 20


def test_our_own_tracker_through_python_has_the_same_boxes(data, tmp_path):
    class Wrapped:
        def init(self, frame, box):
            self.tracker = pursuit.Tracker("kcf")
            self.tracker.init(frame, box)

        def update(self, frame):
            return self.tracker.update(frame)

    results = run(data, tmp_path, {"wrapped": Wrapped, "kcf": "kcf"})["trackers"]
    assert results["wrapped"]["mean"]["auc"] == results["kcf"]["mean"]["auc"]


def test_colour_comes_in_the_order_asked_for(data, tmp_path):
    seen = {}

    class Looks(Still):
        def init(self, frame, box):
            super().init(frame, box)
            seen[self.order] = frame

    for order in ("rgb", "bgr"):
        run(data, tmp_path, {order: type(order, (Looks,), {"order": order})}, sequences="color", channels=order)
    np.testing.assert_array_equal(seen["rgb"], seen["bgr"][..., ::-1])
    assert (seen["rgb"][..., 2] < seen["rgb"][..., 0]).all()


def test_an_exception_ends_a_tracker_on_its_sequence(data, tmp_path):
    class Fails(Still):
        def update(self, frame):
            raise ValueError("no such luck")

    results = run(data, tmp_path, {"mine": Fails})
    assert "ValueError: no such luck" in results["trackers"]["mine"]["sequences"]["gray"]["error"]
    with pytest.raises(pursuit.UsageError, match="neither the name of a tracker"):
        run(data, tmp_path, {"mine": 3})
    with pytest.raises(pursuit.UsageError, match="channels"):
        run(data, tmp_path, [Still], channels="gray")


def test_a_changed_tracker_is_never_taken_for_the_one_before(data, tmp_path):
    first = run(data, tmp_path, {"mine": Still})["trackers"]["mine"]["mean"]["auc"]
    changed = type("Still", (Still,), {"form": staticmethod(lambda box: None)})
    assert run(data, tmp_path, {"mine": changed})["trackers"]["mine"]["mean"]["auc"] < first


def test_results_of_other_programs_and_attributes(data, tmp_path):
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    for name in ("gray", "color"):
        (theirs / f"{name}.txt").write_text("".join(f"{20 + 2 * k},{30 + k},24,24\n" for k in range(10)))
    table = tmp_path / "attributes.csv"
    table.write_text("sequence,attributes\ngray,IV FM\ncolor,FM\n")
    results = run(data, tmp_path, None, results={"theirs": theirs}, attributes=table)["trackers"]
    assert list(results) == ["theirs"]
    assert results["theirs"]["mean"]["auc"] == pytest.approx(20 / 21)
    assert results["theirs"]["attributes"]["FM"]["sequences"] == 2
    assert json.loads((tmp_path / "out/results.json").read_text())["trackers"]["theirs"]["mean"]["auc"]
    assert (tmp_path / "out/tables/attributes.tex").read_text().startswith("\\begin{tabular}")
