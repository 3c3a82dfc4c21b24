"""Many targets: `pursuit eval --protocol mot` beside TrackEval (pip install trackeval), on made-up sequences or on sets that are given.

Made-up sequences hold what rules are about: neutral boxes, regions, small boxes, distractors, classes, sequences without a box.
Figures have to agree to 1e-6. Run by `cargo xtask peers`; with folders, `cargo xtask peers many DATA RESULTS`, where RESULTS holds
SET/SEQUENCE.txt, sets are compared as they are.
"""

import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import trackeval

FIGURES = ("HOTA", "DetA", "AssA", "LocA", "MOTA", "MOTP", "IDF1", "IDR", "IDP", "IDSW", "Frag", "MT", "PT", "ML", "IDTP", "IDFN", "IDFP")
COUNTS = {"TP": "CLR_TP", "FN": "CLR_FN", "FP": "CLR_FP"}
TOLERANCE = 1e-6


def crowd(generator, frames=60, people=7):
    """(frame, id, box, kind) of true things, and (frame, id, box) of what a tracker says of them; boxes on a grid of a tenth of a
    pixel, so that overlaps at the very thresholds come up."""
    truth, said, names = [], [], {}
    at, size = generator.uniform(40, 500, (people, 2)), generator.uniform(20, 60, people)
    kinds = generator.choice(["yes", "yes", "yes", "neutral", "hidden"], people)
    for frame in range(frames):
        at += generator.normal(0, 4, at.shape)
        for person, (x, y) in enumerate(at):
            if not person * 3 <= frame < frames - person * 2:
                continue
            box = np.round([x, y, size[person], 2 * size[person]], 1)
            kind = kinds[person] if generator.random() > 0.05 else "hidden"
            truth.append((frame, person + 1, box, kind))
            if generator.random() < 0.03:
                names[person] = 100 + len(said)
            if generator.random() < 0.85:
                moved = box + np.round([*generator.normal(0, 5, 2), 0, 0], 1) * (generator.random() > 0.3)
                said.append((frame, names.get(person, person + 50), moved))
        for stray in range(generator.integers(0, 3)):
            box = np.round([*generator.uniform(0, 500, 2), 20, generator.uniform(15, 40)], 1)
            said.append((frame, 1000 + 10 * (frame // 7) + stray, box))
        truth.append((frame, -1, np.array([300.0, 300.0, 150.0, 100.0]), "region"))
    return truth, said


def written(path, lines):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(line + "\n" for line in lines))


def numbers(*values):
    return ",".join(f"{v:.10g}" for v in values)


def corners(box):
    return " ".join(f"{v:.10g}" for v in (box[0], box[1], box[0] + box[2], box[1] + box[3]))


def said_lines(said):
    return [numbers(f + 1, i, *box, 1, -1, -1, -1) for f, i, box in said]


def plain(folder, sequences):
    """Truth with neutral boxes and regions, no classes; TrackEval is given it as KITTI's cars."""
    for name, (truth, said) in sequences.items():
        lines = [numbers(f + 1, i, *box, int(kind == "yes")) for f, i, box, kind in truth]
        written(folder / "ours" / "plain" / name / "gt.txt", lines)
        written(folder / "ours" / "plain" / name / "seqinfo.ini", ["[Sequence]", f"name={name}", "frameRate=10", "seqLength=60"])
        written(folder / "said" / "plain" / f"{name}.txt", said_lines(said))


def kitti_twin(folder, sequences):
    """The same to TrackEval: what is neutral is a car that is cut off."""
    lengths = {}
    for name, (truth, said) in sequences.items():
        lines = []
        for f, i, box, kind in truth:
            word = "DontCare" if kind == "region" else "Car"
            lines.append(f"{f} {i} {word} {int(kind in ('neutral', 'hidden'))} 0 0 {corners(box)} 0 0 0 0 0 0 0")
        written(folder / "gt" / "label_02" / f"{name}.txt", lines)
        written(folder / "trackers" / "t" / "data" / f"{name}.txt", [f"{f} {i} Car 0 0 0 {corners(box)} 0 0 0 0 0 0 0 1" for f, i, box in said])
        lengths[name] = max([f for f, *_ in truth + said], default=0) + 1
    written(folder / "gt" / "evaluate_tracking.seqmap.training", [f"{name} empty 000000 {length:06d}" for name, length in lengths.items()])


def of_kitti(folder, classes=("car",)):
    dataset = trackeval.datasets.Kitti2DBox(
        {"GT_FOLDER": str(folder / "gt"), "TRACKERS_FOLDER": str(folder / "trackers"), "CLASSES_TO_EVAL": list(classes), "PRINT_CONFIG": False}
    )
    return judged(dataset)


def of_mot(folder, benchmark):
    dataset = trackeval.datasets.MotChallenge2DBox(
        {
            "GT_FOLDER": str(folder / "gt"),
            "TRACKERS_FOLDER": str(folder / "trackers"),
            "BENCHMARK": benchmark,
            "SPLIT_TO_EVAL": "train",
            "PRINT_CONFIG": False,
        }
    )
    return judged(dataset)


def judged(dataset):
    quiet = {"PRINT_CONFIG": False}
    metrics = [kind(quiet) if kind is not trackeval.metrics.HOTA else kind() for kind in (trackeval.metrics.HOTA, trackeval.metrics.CLEAR, trackeval.metrics.Identity)]
    settings = dict(PRINT_RESULTS=False, OUTPUT_SUMMARY=False, OUTPUT_DETAILED=False, PLOT_CURVES=False, TIME_PROGRESS=False, PRINT_CONFIG=False)
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = trackeval.Evaluator(settings).evaluate([dataset], metrics)
    (by_tracker,) = found.values()
    (by_sequence,) = by_tracker.values()
    return {
        name: {cls: {k: float(np.mean(v)) for kind in by[cls].values() for k, v in kind.items()} for cls in by if not cls.startswith("cls_comb")}
        for name, by in by_sequence.items()
    }


def ours(data, results, out, *more):
    command = [os.environ["PURSUIT"], "eval", str(data), "--protocol", "mot", "--results", f"t={results}", "--out", str(out), "--json", *more]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["trackers"]["t"]


def agree(what, mine, theirs):
    """Holds figures of one sequence, or of a set, against TrackEval's; returns how far they are apart."""
    apart = 0.0
    for key, of in {**{k: k for k in FIGURES}, **COUNTS}.items():
        difference = abs(mine[key] - theirs[of])
        assert difference <= TOLERANCE, f"{what}: {key} is {mine[key]}, TrackEval says {theirs[of]}"
        apart = max(apart, difference)
    return apart


def compare(what, mine, theirs, name_of, cls, sets):
    compared = [agree(f"{what} {name}", mine["sequences"][name_of(name)], by[cls]) for name, by in theirs.items() if name != "COMBINED_SEQ"]
    compared.append(agree(f"{what} combined", sets, theirs["COMBINED_SEQ"][cls]))
    print(f"{what}: {len(compared) - 1} sequences and all together agree with TrackEval, at most {max(compared):.1e} apart")


def made_up(root):
    generator = np.random.default_rng(5)
    sequences = {f"{n:04d}": crowd(generator) for n in range(4)}
    sequences["0004"] = (sequences["0000"][0], [])
    plain(root, sequences)
    kitti_twin(root / "kitti", sequences)
    mine = ours(root / "ours" / "plain", root / "said", root / "out")
    compare("neutral boxes and regions", mine, of_kitti(root / "kitti"), lambda n: f"plain/{n}", "car", mine["sets"]["plain"])
    kitti_classes(root / "classes", generator)
    motchallenge(root, generator)


def kitti_classes(root, generator):
    """KITTI's own form, two classes."""
    lengths = {}
    words = {"car": ("Car", "Van"), "pedestrian": ("Pedestrian", "Person")}
    for n in range(3):
        true, out, length = [], [], 0
        for cls, (word, alike) in words.items():
            truth, said = crowd(generator)
            offset = 0 if cls == "car" else 500
            for f, i, box, kind in truth:
                if kind == "region":
                    true.append(f"{f} -1 DontCare -1 -1 -10 {corners(box)} -1 -1 -1 -1000 -1000 -1000 -10")
                    continue
                named = alike if kind == "neutral" else word
                true.append(f"{f} {i + offset} {named} 0 {3 if kind == 'hidden' else 1} 0 {corners(box)} 0 0 0 0 0 0 0")
            out += [f"{f} {i + 10 * offset} {word} 0 0 0 {corners(box)} 0 0 0 0 0 0 0 0.9" for f, i, box in said]
            length = max([length] + [f + 1 for f, *_ in truth + said])
        lengths[f"{n:04d}"] = length
        written(root / "gt" / "label_02" / f"{n:04d}.txt", true)
        written(root / "trackers" / "t" / "data" / f"{n:04d}.txt", out)
    written(root / "gt" / "evaluate_tracking.seqmap.training", [f"{name} empty 000000 {length:06d}" for name, length in lengths.items()])
    theirs = of_kitti(root, ("car", "pedestrian"))["COMBINED_SEQ"]
    mine = ours(root / "gt", root / "trackers" / "t", root / "out")
    apart = [agree(f"classes {cls}", by["gt"], theirs[cls]) for cls, by in mine["classes"].items()]
    assert set(mine["classes"]) == {"car", "pedestrian"}
    print(f"KITTI's classes: each agrees with TrackEval, at most {max(apart):.1e} apart")


def motchallenge(root, generator):
    """MOT15's form without classes; MOT17's and MOT20's with distractors."""
    classes = {"yes": (1, 1), "hidden": (0, 1), "neutral": (1, 8), "region": (0, 6)}
    for benchmark in ("MOT15", "MOT17", "MOT20"):
        folder, names = root / benchmark, []
        for n in range(3):
            truth, said = crowd(generator)
            name = f"{benchmark}-{n:02d}"
            place = folder / "gt" / f"{benchmark}-train" / name
            lines = []
            for f, i, box, kind in truth:
                flag, cls = classes[kind]
                tail = (int(kind == "yes"), -1, -1, -1) if benchmark == "MOT15" else (flag, cls, 1)
                # A region becomes a vehicle without a motor, which is a distractor of MOT20 alone.
                if kind == "region" and benchmark == "MOT15":
                    continue
                lines.append(numbers(f + 1, 900 if i < 0 else i, *box, *tail))
            written(place / "gt" / "gt.txt", lines)
            written(place / "seqinfo.ini", ["[Sequence]", f"name={name}", "seqLength=60"])
            written(folder / "trackers" / f"{benchmark}-train" / "t" / "data" / f"{name}.txt", said_lines(said))
            names.append(name)
        written(folder / "gt" / "seqmaps" / f"{benchmark}-train.txt", ["name", *names])
        theirs = of_mot(folder, benchmark)
        mine = ours(folder / "gt" / f"{benchmark}-train", folder / "trackers" / f"{benchmark}-train" / "t", folder / "out")
        compare(benchmark, mine, theirs, lambda n, b=benchmark: f"{b}-train/{n}", "pedestrian", mine["sets"][f"{benchmark}-train"])


def rows(path):
    with open(path, encoding="utf-8") as file:
        return [[float(v) for v in line.split(",")] for line in file if line.strip()]


def real(root, data, results):
    """Sets in the plain form, and results beside them, as KITTI's cars to TrackEval."""
    for place in sorted(p for p in pathlib.Path(data).iterdir() if p.is_dir()):
        sequences, regions = {}, False
        for folder in sorted(p for p in place.iterdir() if (p / "gt.txt").is_file()):
            truth = []
            for f, i, x, y, w, h, flag, *_ in rows(folder / "gt.txt"):
                regions |= i < 0
                truth.append((int(f) - 1, int(i), np.array([x, y, w, h]), "region" if i < 0 else "yes" if flag else "neutral"))
            said = [(int(f) - 1, int(i), np.array(box)) for f, i, *box in (r[:6] for r in rows(pathlib.Path(results) / place.name / f"{folder.name}.txt"))]
            sequences[folder.name] = (truth, said)
        mine = ours(place, results, root / "out" / place.name)
        if regions:
            kitti_twin(root / place.name, sequences)
            theirs, cls = of_kitti(root / place.name), "car"
        else:
            folder = root / place.name
            for name, (truth, said) in sequences.items():
                gt = folder / "gt" / "MOT15-train" / name
                written(gt / "gt" / "gt.txt", [",".join(f"{v:.10g}" for v in (f + 1, i, *box, int(kind == "yes"), -1, -1, -1)) for f, i, box, kind in truth])
                written(gt / "seqinfo.ini", ["[Sequence]", f"name={name}", f"seqLength={max(f for f, *_ in truth + said) + 1}"])
                lines = [",".join(f"{v:.10g}" for v in (f + 1, i, *box, 1, -1, -1, -1)) for f, i, box in said]
                written(folder / "trackers" / "MOT15-train" / "t" / "data" / f"{name}.txt", lines)
            written(folder / "gt" / "seqmaps" / "MOT15-train.txt", ["name", *sequences])
            theirs, cls = of_mot(folder, "MOT15"), "pedestrian"
        compare(place.name, mine, theirs, lambda n, s=place.name: f"{s}/{n}", cls, mine["sets"][place.name])


def main():
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) == 3:
            real(pathlib.Path(folder), *sys.argv[1:])
        else:
            made_up(pathlib.Path(folder))


main()
