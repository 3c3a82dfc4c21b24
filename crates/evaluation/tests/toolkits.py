#!/usr/bin/env python3
"""Random trajectories, and what the official toolkits say of them, for the cargo test `toolkits`.

usage: toolkits.py [--seed N] [--cases N] --out FILE
needs, from PyPI: numpy, got10k, vot-toolkit

A committed run of it (seed 1, 2 cases) is tests/fixtures/toolkits.json. To compare fresh cases:
    python crates/evaluation/tests/toolkits.py --seed 7 --out cases.json
    PURSUIT_TOOLKIT_CASES=cases.json cargo test -p pursuit-evaluation --test toolkits
"""
import argparse, json, math, typing
import numpy as np
# attributee 0.1.10, which vot-toolkit needs, uses this decorator wrongly where Python has it (3.11 on) and does without elsewhere.
if hasattr(typing, 'dataclass_transform'): del typing.dataclass_transform
import got10k.experiments.got10k as got10k_experiment
import got10k.experiments.otb as otb_experiment
from got10k.utils.metrics import rect_iou
from vot.analysis import longterm, supervised
from vot.region import Rectangle, Special
from vot.tracker import Trajectory

FAILURE = 2  # vot.experiment.multirun.SupervisedExperiment.FAILURE


def boxes(rng, n):
    """A true box that wanders, and an estimate that sometimes drifts off."""
    truth = np.column_stack([100 + np.cumsum(rng.normal(0, 3, n)), 80 + np.cumsum(rng.normal(0, 3, n)),
                             30 + 10 * rng.random(n), 40 + 10 * rng.random(n)])
    noise = rng.normal(0, 1, (n, 4)) * np.where(rng.random((n, 1)) < 0.25, 25.0, 4.0)
    estimate = truth + noise
    estimate[:, 2:] = np.maximum(estimate[:, 2:], 2)
    return truth.round(3), estimate.round(3)


def one_pass(rng):
    truth, estimate = boxes(rng, 120)
    otb = otb_experiment.ExperimentOTB.__new__(otb_experiment.ExperimentOTB)
    otb.nbins_iou, otb.nbins_ce = 21, 51
    ious, errors = otb._calc_metrics(estimate.copy(), truth.copy())
    success, precision = otb._calc_curves(ious, errors)
    got = got10k_experiment.ExperimentGOT10k.__new__(got10k_experiment.ExperimentGOT10k)
    got.nbins_iou = 101
    after_start = rect_iou(estimate[1:].copy(), truth[1:].copy())
    ao, sr, _, _ = got._evaluate(after_start, np.ones(len(after_start)))
    return dict(truth=truth.tolist(), estimate=estimate.tolist(), success=success.tolist(), precision=precision.tolist(),
                auc=float(np.mean(success)), precision20=float(precision[20]), ao=float(ao), sr50=float(sr))


class Sequence:
    """As much of a toolkit's sequence as its analyses ask for."""
    size, name = (640, 480), "made up"

    def __init__(self, truth): self.truth = truth
    def groundtruth(self): return self.truth
    def __len__(self): return len(self.truth)


class Run:
    def __init__(self, regions): self.list = regions
    def regions(self): return self.list


class Experiment:
    def __init__(self, runs): self.runs = runs
    def gather(self, _tracker, sequence): return [self.runs[id(sequence)]]


def supervised_run(rng, n):
    """Marks: 'i' start, 'f' failure, 's' skipped, a number an overlap."""
    marks, at = [], 0
    while at < n:
        marks.append('i'); at += 1
        while at < n:
            if rng.random() < 0.012:
                marks.append('f'); marks += ['s'] * min(4, n - at - 1); at += 5
                break
            marks.append(round(0.05 + 0.9 * rng.random(), 6)); at += 1
    return marks[:n]


def supervised_case(rng):
    special = {'i': Special(Trajectory.INITIALIZATION), 'f': Special(FAILURE), 's': Special(Trajectory.UNKNOWN)}
    all_marks = [supervised_run(rng, int(rng.integers(150, 500))) for _ in range(5)]
    sequences, runs, overlaps = [], {}, {}
    for marks in all_marks:
        sequence = Sequence([Rectangle(0, 0, 10, 10)] * len(marks))
        sequences.append(sequence)
        regions = [special.get(m, Rectangle(1, 1, 5, 5)) for m in marks]
        runs[id(sequence)] = Run(regions)
        overlaps[id(regions)] = [m if isinstance(m, float) else 0.0 for m in marks]
    # The toolkit rasterises boxes; here the overlaps are given, so that what is compared is what it makes of them.
    supervised.calculate_overlaps = lambda trajectory, _truth, _bounds: overlaps[id(trajectory)]
    per_sequence = []
    for sequence in sequences:
        regions = runs[id(sequence)].regions()
        accuracy, count = supervised.compute_accuracy(regions, sequence, 10, True, True)
        failures = supervised.count_failures(regions)[0]
        per_sequence.append(dict(accuracy=float(accuracy), count=int(count), failures=failures,
                                 robustness=math.exp(-failures / len(sequence) * 30)))
    average = supervised.AverageAccuracyRobustness.aggregate(
        type('Average', (), {'analysis': type('Analysis', (), {'sensitivity': 30})})(), None, sequences,
        [(s['accuracy'], s['failures'], None, len(q)) for s, q in zip(per_sequence, sequences)])
    curve = supervised.EAOCurve().subcompute(Experiment(runs), None, sequences, [])[0]
    return dict(marks=all_marks, sequences=per_sequence, mean_accuracy=float(average[0]), mean_failures=float(average[1]),
                mean_robustness=float(average[2][0]), eao_curve=[float(v) for v in curve],
                eao=float(np.mean(curve[100:356 + 1])))


def long_term_case(rng):
    n = int(rng.integers(90, 400))
    visible = rng.random(n) < 0.8
    score = rng.random(n).round(3)
    overlap = np.where(visible, rng.random(n).round(6), 0.0)
    truth = [Rectangle(0, 0, 10, 10) if v else Special(0) for v in visible]
    sequence, trajectory = Sequence(truth), [Rectangle(1, 1, 5, 5)] * n
    longterm.calculate_overlaps = lambda *_, **__: overlap
    thresholds = longterm.determine_thresholds(score.tolist(), 100)
    precision, recall = longterm.compute_tpr_curves(trajectory, score.tolist(), sequence, thresholds)
    f = [2 * p * r / (p + r) if p + r > 0 else 0.0 for p, r in zip(precision, recall)]
    finite = [t if math.isfinite(t) else math.copysign(1e300, t) for t in thresholds]
    return dict(visible=visible.tolist(), score=score.tolist(), overlap=overlap.tolist(), thresholds=finite,
                precision=[float(p) for p in precision], recall=[float(r) for r in recall], f=float(max(f)))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--cases', type=int, default=2)
    parser.add_argument('--out', required=True)
    a = parser.parse_args()
    rng = np.random.default_rng(a.seed)
    make = lambda case: [case(rng) for _ in range(a.cases)]
    cases = dict(one_pass=make(one_pass), supervised=make(supervised_case), long_term=make(long_term_case))
    with open(a.out, 'w') as out:
        json.dump(cases, out, separators=(',', ':'))
        out.write('\n')


if __name__ == '__main__':
    main()
