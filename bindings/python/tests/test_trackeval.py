"""Results of many targets for TrackEval, and its figures beside ours; what is not installed is skipped."""

import numpy as np
import pursuit
import pytest
from conftest import ROOT
from pursuit.integrations.trackeval import export, rows, scores

PETS = ROOT.parent / "shared" / "data" / "human" / "pets09_s2l1"
FIGURES = ("HOTA", "DetA", "AssA", "LocA", "MOTA", "MOTP", "IDF1", "IDR", "IDP", "CLR_TP", "CLR_FN", "CLR_FP", "IDSW", "IDTP", "IDFN", "IDFP")


def judged(config):
    """What TrackEval says of each sequence, means over HOTA's thresholds."""
    trackeval = pytest.importorskip("trackeval")
    quiet = {"PRINT_CONFIG": False}
    metrics = [kind(quiet) for kind in (trackeval.metrics.HOTA, trackeval.metrics.CLEAR, trackeval.metrics.Identity)]
    evaluator = trackeval.Evaluator(
        quiet | dict(PRINT_RESULTS=False, OUTPUT_SUMMARY=False, OUTPUT_DETAILED=False, PLOT_CURVES=False, TIME_PROGRESS=False, OUTPUT_EMPTY_CLASSES=False)
    )
    found, _ = evaluator.evaluate([trackeval.datasets.MotChallenge2DBox(config | quiet)], metrics)
    (tracker,) = config["TRACKERS_TO_EVAL"]
    found = found["MotChallenge2DBox"][tracker]
    flat = {name: {k: v for kind in by["pedestrian"].values() for k, v in kind.items()} for name, by in found.items()}
    return {name: {k: float(np.mean(by[k])) for k in FIGURES} for name, by in flat.items() if name != "COMBINED_SEQ"}


def crowd(seed, frames=60, people=6):
    """People who wander, and what a tracker might say of them: late, missing, called otherwise, twice, at nothing."""
    generator = np.random.default_rng(seed)
    truth, said, names = [], [], {}
    at = generator.uniform(50, 400, (people, 2))
    for frame in range(frames):
        at += generator.normal(0, 4, at.shape)
        for person, (x, y) in enumerate(at):
            if not person * 3 <= frame < frames - person * 2:
                continue
            # One in twenty is not to be counted.
            truth.append((frame + 1, person + 1, x, y, 30, 70, int(generator.random() > 0.05)))
            if generator.random() < 0.03:
                names[person] = 100 + len(said)
            if generator.random() < 0.85:
                dx, dy = generator.normal(0, 8, 2)
                said.append((frame + 1, names.get(person, person + 50), x + dx, y + dy, 32, 66, 0.9))
        if generator.random() < 0.3:
            said.append((frame + 1, 1000 + frame // 7, *generator.uniform(50, 400, 2), 30, 70, 0.4))
    return truth, said


def written(path, lines):
    path.write_text("".join(",".join(f"{v:.3f}" if i > 1 and i < 6 else f"{v:g}" for i, v in enumerate(line)) + ",-1,-1,-1\n" for line in lines))
    return path


def test_figures_of_made_up_crowds_are_trackeval_s(tmp_path):
    pytest.importorskip("trackeval")
    results, truth = {}, {}
    for seed in range(6):
        true, said = crowd(seed)
        truth[f"crowd-{seed}"] = written(tmp_path / f"gt-{seed}.txt", true)
        results[f"crowd-{seed}"] = written(tmp_path / f"said-{seed}.txt", said)
    results["nothing"] = written(tmp_path / "said.txt", [])
    truth["nothing"] = truth["crowd-0"]
    theirs = judged(export(results, tmp_path / "judged", truth=truth))
    assert set(theirs) == set(results)
    for name, figures in theirs.items():
        ours = scores(results[name], truth[name])
        for key in FIGURES:
            assert ours[key] == pytest.approx(figures[key], abs=1e-9), f"{name}: {key}"
    assert 0 < theirs["crowd-1"]["HOTA"] < 1 and theirs["crowd-1"]["IDSW"] > 0, "the crowds are too easy to tell measures apart"


def test_figures_of_people_on_footage_are_trackeval_s(tmp_path):
    pytest.importorskip("trackeval")
    cv2 = pytest.importorskip("cv2")
    if not PETS.is_dir():
        pytest.skip(f"no footage in {PETS}")
    video, tracker, estimates = cv2.VideoCapture(str(PETS / "vtest.avi")), pursuit.MultiTracker(detector="motion", fps=7, channels="bgr"), []
    while (read := video.read())[0]:
        estimates += tracker.update(read[1])
    truth = {"PETS09-S2L1": PETS / "gt_mot.txt"}
    theirs = judged(export({"PETS09-S2L1": estimates}, tmp_path, truth=truth))["PETS09-S2L1"]
    written_down = tmp_path / "trackers" / "MOT15-train" / "pursuit" / "data" / "PETS09-S2L1.txt"
    ours = scores(written_down, truth["PETS09-S2L1"])
    for key in FIGURES:
        assert ours[key] == pytest.approx(theirs[key], abs=1e-6), key
    # Files keep three decimals; of the boxes themselves the figures are all but the same.
    assert scores(estimates, truth["PETS09-S2L1"])["HOTA"] == pytest.approx(theirs["HOTA"], abs=1e-3)
    print({key: round(ours[key], 4) for key in FIGURES})
    assert ours["MOTA"] > 0.5


def test_every_kind_of_result_is_the_same(tmp_path):
    track = pursuit.track("scene:drift?seed=7&duration=1", tracker="mosse", out=tmp_path / "clips" / "drift", formats=["mot"], video=False)
    config = export({"drift": track}, tmp_path / "a")
    assert config["TRACKERS_TO_EVAL"] == ["pursuit"]
    ours = (tmp_path / "a/trackers/MOT15-train/pursuit/data/drift.txt").read_text()
    assert ours == (tmp_path / "clips/drift/trajectory.txt").read_text()
    export(tmp_path, tmp_path / "b", tracker="mosse", benchmark="MOT17", split="test")
    assert ours == (tmp_path / "b/trackers/MOT17-test/mosse/data/drift.txt").read_text()
    assert (tmp_path / "b/gt/seqmaps/MOT17-test.txt").read_text() == "name\ndrift\n"
    for same in (tmp_path / "clips" / "drift", tmp_path / "clips/drift/trajectory.csv", tmp_path / "clips/drift/trajectory.txt", track.estimates):
        np.testing.assert_allclose(rows(same), rows(track), atol=2e-3)
    alone = scores(track, tmp_path / "clips/drift/trajectory.txt")
    assert alone["MOTA"] == 1 and alone["IDF1"] == 1 and alone["HOTA"] > 0.99


def test_what_cannot_be_read_is_told(tmp_path):
    track = pursuit.track("scene:drift?seed=7&duration=1", tracker="mosse")
    bad, empty = tmp_path / "bad.txt", tmp_path / "gt.txt"
    bad.write_text("1,2,3\n")
    empty.write_text("")
    for results, truth, words in [
        ({}, None, "no results"),
        (tmp_path, None, "trajectory.csv"),
        ({"a": track}, {"b": empty}, "same sequences: a, b"),
        ({"a": bad}, None, "line 1: 3 cells"),
        ({"a": 3}, None, "int holds no estimates"),
        ({"a": tmp_path / "none.csv"}, None, "none.csv"),
    ]:
        with pytest.raises(pursuit.PursuitError, match=words):
            export(results, tmp_path / "out", truth=truth)
    with pytest.raises(pursuit.UsageError, match="threshold"):
        scores(track, empty, threshold=0)
    twice = tmp_path / "twice.txt"
    twice.write_text("1,1,0,0,9,9\n1,1,5,5,9,9\n")
    with pytest.raises(pursuit.PursuitError, match="two boxes in frame 0"):
        scores(track, twice)
