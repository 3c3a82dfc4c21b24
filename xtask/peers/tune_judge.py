#!/usr/bin/env python3
"""Fits the judge of the tracker `pursuit` on annotated sequences, with one source left out in turn.

usage (from the repository): cargo xtask tune DATA [DATA...] [--out DIR] [--set KEY=VALUE ...] [--only FEATURES]
needs, from PyPI: numpy, scipy

DATA holds sequences at any depth: a folder with frames.csv (index,image,x,y,w,h) or NAME.mp4 with NAME.csv (index,x,y,w,h).
What a sequence is called says where it is from (OTB_, TLD_, VOT_, ...; thermal ones and those from the air are a source each).

The tracker runs over each sequence (what a former call left in DIR is used again); what both witnesses said of each box is
read from `trajectory.jsonl`. A logistic regression predicts whether a box overlaps the truth by one half. Every sequence
counts by the square root of its length. Printed: the weights of the fit to all, their spread over the folds, those fitted without each source, and, by fits
to the other sources, the log loss, the calibration error and the errors at several thresholds.
"""
import argparse, csv, json, os, subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import numpy as np
from scipy.optimize import minimize

SOURCES = {'TIR': 'thermal', 'AntiUAV-IR': 'thermal', 'UAV123': 'air', 'UAVDT': 'air', 'DTB70': 'air', 'opencv': 'OTB'}
# How the judge takes a figure: the words of `pursuit trackers pursuit --json`.
TAKEN = {'as-is': lambda v: v, 'ln': lambda v: np.log(max(v, 1e-3)), 'ln-1p': np.log1p}


def terms():
    """Of each term of the judge: its column without the witness, its weight's name, and how it is taken."""
    told = subprocess.run([os.environ['PURSUIT'], 'trackers', 'pursuit', '--json'], check=True, stdout=subprocess.PIPE)
    weighed = [f for f in json.loads(told.stdout)['trackers'][0]['figures'] if f['weight'] and f['name'].startswith('filter_')]
    return {f['name'].removeprefix('filter_'): (f['weight']['parameter'], TAKEN[f['weight']['taken']]) for f in weighed}


def sequences(root):
    """name, footage, true boxes [n, 4] (nan: absent)"""
    boxes = lambda rows: np.array([[float(r[k] or 'nan') for k in 'xywh'] for r in rows])
    for folder, _, files in sorted(os.walk(root, followlinks=True)):
        if 'frames.csv' in files:
            yield Path(folder).name, folder, boxes(list(csv.DictReader(open(Path(folder) / 'frames.csv'))))
        for file in sorted(f for f in files if f.endswith('.mp4')):
            truth = Path(folder, file).with_suffix('.csv')
            if truth.exists():
                yield truth.stem, str(Path(folder, file)), boxes(list(csv.DictReader(open(truth))))


def source(name):
    head = name.split('_')[0]
    return SOURCES.get(head, head)


def overlap(a, b):
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[:2] + a[2:], b[:2] + b[2:])
    both = np.prod(np.clip(high - low, 0, None))
    return both / (np.prod(a[2:]) + np.prod(b[2:]) - both)


def track(options, out, sequence):
    """What was said of a sequence, a line a frame."""
    name, footage, truth = sequence
    first = int(np.argmax(~np.isnan(truth[:, 0])))
    out = out / name
    lines = out / 'trajectory.jsonl'
    if not lines.exists():
        command = [os.environ['PURSUIT'], 'track', footage, '--box', ','.join(map(str, truth[first])), '--from', str(first)]
        command += ['--tracker', 'pursuit', '--no-video', '--threads', '1', '--format', 'jsonl', '-q', '--out', str(out)]
        subprocess.run(command + [a for s in options.set for a in ('--set', s)], check=True, stdout=subprocess.DEVNULL)
    rows = [json.loads(line) for line in open(lines)]
    return [r for r in rows if first < r['frame'] < len(truth) and r['diagnostics']]


def samples(name, truth, rows, features):
    """Features, whether right, whether absent, of every box that was followed."""
    for row in rows:
        said, true = row['diagnostics'], truth[row['frame']]
        witness = 'expert' if said.get('expert_leads') == 1 else 'filter' if said.get('filter_leads') == 1 else 'network'
        if f'{witness}_x' not in said:
            continue
        box = np.array(row['measurement'] if said.get('agreed') == 1 and witness != 'expert' else [said[f'{witness}_{k}'] for k in 'xywh'])
        absent = bool(np.isnan(true[0]))
        values = [taken(said[f'{witness}_{column}']) for column, (_, taken) in features.items()]
        yield values, not absent and overlap(box, true) >= 0.5, absent


def fit(x, y, weight):
    """Weights of a logistic regression, the constant last; each is scaled and held near nought a little."""
    mean, scale = x.mean(0), x.std(0) + 1e-9
    z, sign = np.c_[(x - mean) / scale, np.ones(len(x))], np.where(y, 1.0, -1.0)

    def loss(w):
        margin = sign * (z @ w)
        slope = -sign * weight / (1 + np.exp(np.clip(margin, -500, 500)))
        held = np.r_[w[:-1], 0]
        return (weight * np.logaddexp(0, -margin)).sum() + 0.5 * held @ held, z.T @ slope + held

    w = minimize(loss, np.zeros(z.shape[1]), jac=True, method='L-BFGS-B').x
    return np.r_[w[:-1] / scale, w[-1] - (w[:-1] * mean / scale).sum()]


def report(p, y, absent, weight):
    clipped = np.clip(p, 1e-4, 1 - 1e-4)
    loss = -np.average(np.where(y, np.log(clipped), np.log(1 - clipped)), weights=weight)
    bins = np.minimum((p * 10).astype(int), 9)
    error = sum(abs(p[bins == b].sum() - y[bins == b].sum()) for b in range(10)) / len(p)
    print(f'left out: log loss {loss:.4f}, calibration error {error:.3f}')
    share = lambda of, below: np.mean(below[of]) if of.any() else float('nan')
    for threshold in (0.5, 0.6, 0.7, 0.8, 0.9):
        print(f'  at {threshold}: right below {share(y, p < threshold):.3f}, wrong above {share(~y & ~absent, p >= threshold):.3f}, '
              f'absent above {share(absent, p >= threshold):.3f}')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', nargs='+')
    parser.add_argument('--out', type=Path, default=Path('target/tune'))
    parser.add_argument('--set', action='append', default=[], metavar='KEY=VALUE')
    parser.add_argument('--only', default='', metavar='FEATURES', help='columns to fit, comma-separated; all unless given')
    parser.add_argument('--jobs', type=int, default=1)
    options = parser.parse_args()
    known = terms()
    features = {column: known[column] for column in options.only.split(',')} if options.only else known
    # Folders may hold sequences of the same names.
    found = [(options.out / Path(root).resolve().name, s) for root in options.data for s in sequences(root)]
    with ThreadPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(lambda pair: track(options, *pair), found))
    x, y, absent, sources, weight = [], [], [], [], []
    for (_, (name, _, truth)), said in zip(found, rows):
        taken = list(samples(name, truth, said, features))
        x += [v for v, _, _ in taken]
        y += [v for _, v, _ in taken]
        absent += [v for _, _, v in taken]
        sources += [source(name)] * len(taken)
        weight += [len(taken) ** -0.5] * len(taken)
    x, y, absent, sources, weight = map(np.array, (x, y, absent, sources, weight))
    weight /= weight.mean()
    folds, left_out = [], np.zeros(len(y))
    for held in sorted(set(sources)):
        w = fit(x[sources != held], y[sources != held], weight[sources != held])
        left_out[sources == held] = 1 / (1 + np.exp(-(x[sources == held] @ w[:-1] + w[-1])))
        folds.append(w)
    names = [*(weight for weight, _ in features.values()), 'judge.bias']
    print(f'{len(y)} boxes of {len(found)} sequences from {", ".join(sorted(set(sources)))}; {y.mean():.3f} right')
    for name, w, low, high in zip(names, fit(x, y, weight), np.min(folds, 0), np.max(folds, 0)):
        print(f'  {name} = {w:.3f}   ({low:.3f} to {high:.3f})')
    for held, fold in zip(sorted(set(sources)), folds):
        print(f'  without {held}: ' + ' '.join(f'--set {name}={w:.3f}' for name, w in zip(names, fold)))
    report(left_out, y, absent, weight)


if __name__ == '__main__':
    main()
