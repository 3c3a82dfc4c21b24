#!/usr/bin/env python3
"""Our trackers beside OpenCV's CSRT and KCF on annotated sequences: speed as multiples of CSRT's, in one run, by turns.

usage (from the repository): cargo xtask peers speed DATA [--trackers kcf,pursuit] [--sequences GLOB] [--rounds 2]
needs, from PyPI: numpy, opencv-contrib-python-headless

DATA holds sequences at any depth: a folder with frames.csv (index,image,x,y,w,h) or NAME.mp4 with NAME.csv (index,x,y,w,h).
One thread, processor time, updates only, frames decoded beforehand. On both sides whatever a tracker derives from a frame
(grey, colour planes) counts: ours are given each frame with nothing derived from it yet. On every sequence the trackers
take turns, `rounds` times; a tracker's time there is the mean over the rounds. Ratios are geometric means over sequences.
OpenCV's trackers run as shipped; one that has given up returns at once, so read its speed beside `lost`.
"""
import argparse, csv, fnmatch, json, os, tempfile
from timing import cv2, geometric, np, opencv, ours, overlap, time, update, whole

# Least multiples of CSRT's speed that are aimed at.
BARS = {'kcf': 22, 'kcf-fixed': 48, 'mosse': 60, 'dsst': 8, 'fdsst': 8, 'pursuit-light': 4, 'pursuit': 5}


def sequences(root):
    """name -> (images or a video, true boxes [n, 4])"""
    boxes = lambda rows: np.array([[float(r[k] or 'nan') for k in 'xywh'] for r in rows])
    found = {}
    for folder, _, files in os.walk(root, followlinks=True):
        if 'frames.csv' in files:
            rows = list(csv.DictReader(open(os.path.join(folder, 'frames.csv'))))
            found[os.path.relpath(folder, root)] = ([os.path.join(folder, r['image']) for r in rows], boxes(rows))
        for file in files:
            truth = os.path.join(folder, file[:-4] + '.csv')
            if file.endswith('.mp4') and os.path.exists(truth):
                name = os.path.relpath(os.path.join(folder, file[:-4]), root)
                found[name] = (os.path.join(folder, file), boxes(list(csv.DictReader(open(truth)))))
    return dict(sorted(found.items()))


def load(footage):
    if isinstance(footage, list):
        return [cv2.imread(f) for f in footage]
    video, images = cv2.VideoCapture(footage), []
    while True:
        read, image = video.read()
        if not read:
            return images
        images.append(image)


def success(overlaps):
    return float(np.mean([(overlaps > t).mean() for t in np.linspace(0, 1, 21)]))


def peer(name, images, truth):
    annotated = np.isfinite(truth).all(1) & (truth[:, 2:] > 0).all(1)
    first = int(np.argmax(annotated))
    tracker = opencv(name)
    tracker.init(images[first], whole(truth[first]))
    seconds, said = [], [(True, truth[first])]
    for image in images[first + 1:len(truth)]:
        began = time.process_time()
        answer = update(tracker, image)
        seconds.append(time.process_time() - began)
        said.append(answer)
    counted = annotated[first:first + len(said)]
    overlaps = np.array([overlap(b, t) if seen else 0.0 for (seen, b), t in zip(said, truth[first:])])[counted]
    lost = np.mean([not seen for (seen, _), c in zip(said, counted) if c])
    return dict(fps=1 / max(np.mean(seconds), 1e-9), auc=success(overlaps), lost=lost)


def ours_on(root, name, trackers):
    with tempfile.TemporaryDirectory() as out:
        # A comma or a bracket in a name would be read as a pattern.
        pattern = ''.join('?' if c in ',[]{}*' else c for c in name)
        said = ours('eval', root, '--trackers', ','.join(trackers), '--sequences', pattern, '--out', out, '--no-report',
                    '--json', '--quiet')
    return {t: r['sequences'][name] for t, r in said['trackers'].items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('data')
    parser.add_argument('--trackers', default='mosse,kcf-fixed,kcf,pursuit')
    parser.add_argument('--peers', default='csrt,kcf')
    parser.add_argument('--sequences', default='*')
    parser.add_argument('--rounds', type=int, default=2)
    parser.add_argument('--json', help='file for the figures of every sequence')
    parser.add_argument('--check', action='store_true', help='exit with 1 when a tracker is slower than aimed at')
    a = parser.parse_args()
    cv2.setNumThreads(1)
    found = {n: s for n, s in sequences(a.data).items() if any(fnmatch.fnmatch(n, p) for p in a.sequences.split(','))}
    if not found:
        parser.error(f'no sequence under {a.data} matches {a.sequences}')
    figures = {}
    for name, (footage, truth) in found.items():
        images = load(footage)
        rounds = {}
        for _ in range(a.rounds):
            for tracker, score in ours_on(a.data, name, a.trackers.split(',')).items():
                rounds.setdefault(tracker, []).append({k: score[k] for k in ('fps', 'auc', 'lost')})
            for tracker in a.peers.split(','):
                rounds.setdefault(f'OpenCV {tracker.upper()}', []).append(peer(tracker, images, truth))
        for tracker, scores in rounds.items():
            fps = len(scores) / sum(1 / s['fps'] for s in scores)
            figures.setdefault(tracker, {})[name] = dict(scores[0], fps=fps)
        csrt = figures['OpenCV CSRT'][name]['fps']
        print(f'{name:28s}', '  '.join(f'{t} {v[name]["fps"] / csrt:.1f}x' for t, v in figures.items()), flush=True)
    if a.json:
        json.dump(figures, open(a.json, 'w'), indent=1, default=float)
    print(f'\n{len(found)} sequences, {a.rounds} rounds, one thread, processor time, updates only')
    print(f'{"tracker":14s} {"frames/s":>9s} {"x CSRT":>8s} {"least":>7s} {"AUC":>6s} {"lost":>6s}  aim')
    csrt, missed = figures['OpenCV CSRT'], []
    for tracker, by_name in figures.items():
        ratios = [v['fps'] / csrt[n]['fps'] for n, v in by_name.items()]
        mean = lambda key: float(np.mean([v[key] for v in by_name.values()]))
        aim, ratio = BARS.get(tracker), geometric(ratios)
        if aim and ratio < aim:
            missed.append(tracker)
        said = '' if aim is None else f'{aim}x ' + ('reached' if ratio >= aim else 'missed')
        print(f'{tracker:14s} {geometric([v["fps"] for v in by_name.values()]):9.1f} {ratio:8.2f} {min(ratios):7.2f} '
              f'{mean("auc"):6.3f} {mean("lost"):6.2f}  {said}')
    if a.check and missed:
        raise SystemExit(1)


if __name__ == '__main__':
    main()
